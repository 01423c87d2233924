"""The residual test keeps its false-alarm rate; its z values are those of algebra."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from dense import NOISE, covariance, prepared_case
from scipy import stats

from hdcal.evidence.linear_rows import whiten
from hdcal.evidence.prepare import with_rows
from hdcal.evidence.residual_test import Directions, pull_back, residual_test
from hdcal.inference.serial_correlation import previous_rows

SIZE, RUNS = 24, 120


def directions() -> Directions:
    """Return cells and curves that the base model does not hold, and others."""
    records = prepared_case().records
    cells = np.stack(
        [
            records.sense > 0,
            records.temperature > 60.0,
            records.deformation < 0.2,
            (records.sense > 0) & (records.deformation > 0.3),
        ],
        axis=1,
    )
    curves = np.stack([records.deformation**2, np.sin(records.angle)], axis=1)
    return Directions(cells.astype(float), curves, labels(), waves())


def labels():
    return (np.arange(SIZE) // 3)[:, None]


def waves():
    return np.sin(np.arange(SIZE)[:, None] * np.arange(1, 9))


@cache
def null_tests(correlation, believed):
    """Return tests of pure noise about a base model drawn from its prior."""
    prepared = prepared_case()
    rng = np.random.default_rng(17)
    lag = np.abs(np.arange(SIZE)[:, None] - np.arange(SIZE))
    factor = np.linalg.cholesky(correlation**lag)
    found = []
    for _ in range(RUNS):
        noise = NOISE * factor @ rng.normal(size=SIZE)
        reading = prepared.rows.base @ rng.normal(size=4) + noise
        one = replace(prepared, rows=replace(prepared.rows, reading=reading))
        found.append(residual_test(one, believed, directions(), rng))
    return found


@pytest.mark.parametrize("correlation", [0.0, 0.5])
@pytest.mark.parametrize(
    "statistic", ["largest", "between", "local", "spread", "tails"]
)
def test_p_values_of_noise_are_uniform(statistic, correlation):
    values = [
        g.statistics[f"p_{statistic}"] for g in null_tests(correlation, correlation)
    ]
    assert stats.kstest(values, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_noise_fails_the_test_as_seldom_as_it_says(correlation):
    alarms = sum(g.p_value <= 0.05 for g in null_tests(correlation, correlation))
    assert stats.binomtest(alarms, RUNS, 0.05, "greater").pvalue > 1e-3


def test_rows_left_out_say_nothing_and_hide_nothing():
    """A wild reading in the midst of a cell that is off."""
    prepared, kept = prepared_case(), np.ones(SIZE, bool)
    kept[[0, 13]] = False
    there = Directions(*(column[kept] for column in vars(directions()).values()))
    off = NOISE * np.random.default_rng(3).normal(size=SIZE)
    off += 4.0 * NOISE * directions().cells[:, 3]
    found = []
    for wild in (30.0, 3000.0):
        reading = off + wild * NOISE * ~kept
        rows = replace(prepared.rows, reading=reading)
        one = with_rows(replace(prepared, rows=rows), kept)
        np.testing.assert_array_equal(one.rows.before, previous_rows(one.records))
        found.append(residual_test(one, 0.5, there, np.random.default_rng(0)))
    assert found[0].mean_p_value == found[1].mean_p_value < 0.05
    assert np.argmax(np.abs(found[0].z[:4])) == 3


def test_serial_noise_taken_for_independent_is_noticed():
    """The check can fail: the same noise, its correlation not known."""
    alarms = sum(g.p_value <= 0.05 for g in null_tests(0.5, 0.0))
    assert stats.binomtest(alarms, RUNS, 0.05, "greater").pvalue < 1e-3, alarms


@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_pulling_back_is_the_transposed_inverse(correlation):
    before = np.where(np.isin(np.arange(9), [0, 4, 8]), -1, np.arange(9) - 1)
    weight = np.linspace(0.5, 1.5, 9)
    prepared = prepared_case(rows=12)
    rows = replace(prepared.rows, before=before, weight=weight)
    matrix = np.asarray(whiten(rows, np.eye(9), correlation))
    cells = np.random.default_rng(1).normal(size=(9, 3))
    found = pull_back(before, weight, correlation, cells)
    np.testing.assert_allclose(found, np.linalg.solve(matrix.T, cells), atol=1e-12)


@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_z_of_a_cell_is_its_sum_over_its_sd(correlation):
    """Generalised least squares with dense matrices; slope and offset are free."""
    prepared, declared = prepared_case(0.8), directions()
    cells = declared.cells
    rows = prepared.rows
    serial = covariance(replace(rows, base=0.0 * rows.base), correlation)
    below = np.asarray(rows.precision).copy()
    below[:2] = 0.0
    base, reading = np.asarray(rows.base), np.asarray(rows.reading)
    inverse = np.linalg.inv(serial)
    gram = base.T @ inverse @ base + np.diag(below)
    smooth = base @ np.linalg.solve(gram, base.T @ inverse)
    residual = reading - smooth @ reading
    # In units of σ²: prior rows are data with noise too.
    spread = serial - base @ np.linalg.solve(gram, base.T)
    found = residual_test(prepared, correlation, declared, np.random.default_rng(0))
    np.testing.assert_allclose(found.residual, residual, atol=1e-8)
    # Before the common factor, the noise sd.
    total = cells.T @ residual
    sd = np.sqrt(np.diag(cells.T @ spread @ cells))
    z = total / sd / found.noise_sd
    np.testing.assert_allclose(found.z[: cells.shape[1]], z, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(found.bias, total / cells.sum(axis=0), atol=1e-8)
    white = np.asarray(whiten(rows, residual, correlation))
    freedom = SIZE - np.trace(smooth)
    assert found.noise_sd == pytest.approx(np.sqrt(white @ white / freedom))
