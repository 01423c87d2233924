"""Shapes in residuals are found when they are there, and seldom when they are not."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import autoregression, cycles
from scipy import stats
from short import SHORT
from slices import slice_of

from hdcal.calibration.calibrate import calibrate
from hdcal.data.prior import Prior
from hdcal.data.priors import rig_priors
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder
from hdcal.inference.residual_shapes import (
    FALSE_ALARM,
    Correlated,
    Whitened,
    find_structure,
    orthonormal,
    shapes_of,
)
from hdcal.inference.residuals import residuals
from hdcal.inference.serial_correlation import CORRELATION, previous_rows

SIZE_OF_SHAPE = 6.0


# Time that is not just the order of the rows.
RECORDS = replace(cycles(96), time=np.arange(96.0) ** 2)


def whitened(error: np.ndarray) -> Whitened:
    """Return what an offset and a slope leave of the error, in noise sds."""
    deformation = np.asarray(RECORDS.deformation)
    absorbed = np.column_stack([np.ones(len(error)), deformation])
    return Whitened(error, absorbed, shapes_of(RECORDS, 20.0))


@pytest.mark.parametrize("name", shapes_of(RECORDS, 20.0))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_shape_is_found_with_its_sign(name, sign):
    rng = np.random.default_rng(1)
    column, up, down = shapes_of(RECORDS, 20.0)[name]
    column = column - column.mean()
    noise = rng.normal(size=96)
    shape = sign * SIZE_OF_SHAPE * column / column.std()
    found = find_structure(whitened(noise + shape), np.ones(96))
    assert found[0].name == name
    assert (up if sign > 0 else down) in found[0].words


def test_noise_raises_few_false_alarms():
    rng = np.random.default_rng(2)
    alarms = sum(
        bool(find_structure(whitened(rng.normal(size=96)), np.ones(96)))
        for _ in range(1000)
    )
    assert stats.binomtest(alarms, 1000, FALSE_ALARM, "greater").pvalue > 1e-3


def test_what_the_priors_allow_is_absorbed_and_no_more():
    """A shape along a parameter is found only beyond that parameter's prior."""
    rng = np.random.default_rng(3)
    data = whitened(rng.normal(size=96) + np.asarray(cycles(96).sense))
    column = np.asarray(cycles(96).sense)
    for prior_sd, expected in ((1e-4, True), (1e4, False)):
        with_prior = Whitened(
            residual=np.append(data.residual, 0.0),
            absorbed=np.vstack(
                [
                    np.column_stack([data.absorbed, column * prior_sd]),
                    [0.0, 0.0, 1.0],
                ]
            ),
            shapes={n: (np.append(c, 0.0), *w) for n, (c, *w) in data.shapes.items()},
        )
        found = [shape.name for shape in find_structure(with_prior, np.ones(96))]
        assert ("direction" in found) is expected


@pytest.mark.thorough
def test_the_article_s_data_bend_upwards():
    left = residuals(calibrate(read_case(datasets_folder() / "xb1-100-80"), **SHORT))
    assert [shape.name for shape in left.structure] == ["curvature"]
    assert "convex" in left.structure[0].words
    assert left.structure[0].p_value < 1e-3


@pytest.mark.thorough
def test_thermal_demo_needs_its_effect():
    case = read_case(datasets_folder() / "thermal-demo")
    without = calibrate(case, **SHORT)
    assert [s.name for s in residuals(without).structure] == ["temperature"]
    effect = calibrate(case, effects=["thermal_zero_drift"], **SHORT)
    assert residuals(effect).structure == ()
    truth = {
        "K": 2.5,
        "alpha": 3.2e-4,
        "force_offset": 1.5,
        "deformation_offset": 0.004,
        "sigma": 0.4,
        "thermal_zero_drift.slope": 0.12,
    }
    for name, value in truth.items():
        low, high = np.quantile(effect.draws[name], [0.025, 0.975])
        assert low < value < high, name


# --- noise whose neighbours err alike, simulated: no sampler ---

PRIOR = rig_priors()[CORRELATION]
ALIKE = Correlated(previous_rows(RECORDS), PRIOR)


def errors(rho: float, rng, count: int) -> list[np.ndarray]:
    """Return autoregressive errors of 96 rows, sd 1."""
    run = np.zeros(96, int)
    return [autoregression(rng.normal(size=96), run, rho) for _ in range(count)]


def alarms(rho: float, noise, count: int, bend: float = 0.0) -> int:
    """Return how often a shape is found; `bend` is its rms in noise sds."""
    column = whitened(np.zeros(96)).shapes["curvature"][0]
    basis = orthonormal(whitened(np.zeros(96)).absorbed)
    left = column - basis @ (basis.T @ column)
    shape = bend * left / left.std()
    rng = np.random.default_rng(11)
    found = (
        find_structure(whitened(error + shape), np.ones(96), noise)
        for error in errors(rho, rng, count)
    )
    return sum(bool(shapes) for shapes in found)


@pytest.mark.parametrize("rho", slice_of([0.0, 0.3, 0.6, 0.8], [0.6]))
def test_correlated_noise_raises_few_false_alarms(rho: float):
    few = alarms(rho, ALIKE, 400)
    assert stats.binomtest(few, 400, FALSE_ALARM, "greater").pvalue > 1e-3


def test_correlated_noise_taken_for_independent_is_noticed():
    """The check can fail: as it was before the correlation was allowed for."""
    many = alarms(0.6, None, 200)
    assert stats.binomtest(many, 200, FALSE_ALARM, "greater").pvalue < 1e-6


@pytest.mark.parametrize(("rho", "bend"), [(0.0, 0.6), (0.0, 3.0), (0.5, 1.2)])
def test_a_bend_is_found_in_correlated_noise(rho: float, bend: float):
    """A large one does not pass for a large correlation."""
    assert alarms(rho, ALIKE, 60, bend) >= 55


def test_a_known_correlation_is_generalised_least_squares():
    """With dense matrices, runs that alternate included."""
    rng, rho = np.random.default_rng(5), 0.6
    run = np.arange(96) % 3
    records = replace(RECORDS, run=run)
    error = autoregression(rng.normal(size=96), run, rho)
    data = whitened(error + 3.0 * np.asarray(RECORDS.sense))
    noise = Correlated(previous_rows(records), Prior("fixed", (rho,)))
    found = {shape.name: shape for shape in find_structure(data, np.ones(96), noise)}
    apart = np.abs(np.arange(96)[:, None] - np.arange(96)) // 3
    inverse = np.linalg.inv(np.where(run[:, None] == run, rho**apart, 0.0))
    design = np.column_stack([data.absorbed, data.shapes["direction"][0]])
    cover = np.linalg.inv(design.T @ inverse @ design)
    fit = cover @ design.T @ inverse @ data.residual
    left = data.residual - design @ fit
    t = fit[-1] / np.sqrt(cover[-1, -1] * (left @ inverse @ left) / 93)
    p = 2.0 * stats.t.sf(abs(t), 93) * len(data.shapes)
    assert found["direction"].p_value == pytest.approx(p, rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_smoothing_the_deformation_leaves_no_shape_over_the_rows(seed):
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 2.0, 400)
    readings = {
        "displacement_mm": x + rng.normal(0.0, 0.12, 400),
        "force_N": 120.0 * x + rng.normal(0.0, 0.2, 400),
    }
    case = read_case(readings)
    assert case.screening is not None
    assert case.screening.deformation_sd == pytest.approx(0.12, rel=0.1)
    assert residuals(calibrate(case, **SHORT)).structure == ()
