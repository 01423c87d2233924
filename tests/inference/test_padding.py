"""Rows are padded to few lengths, and padding counts for nothing."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import draw_truth, make_case, make_gear
from scipy import stats
from structures import form_of

from hdcal.data.priors import effect_priors
from hdcal.inference.force_model.identifiability import linearise
from hdcal.inference.force_model.padding import bucket_size
from hdcal.inference.force_model.problem import Problem, build_problem


def test_few_lengths_hold_every_number_of_rows():
    sizes = [bucket_size(rows) for rows in range(3000)]
    powers = [2**k for k in range(4, 13)]
    lengths = sorted([*powers, *(3 * power // 2 for power in powers)])
    assert sorted({*sizes}) == [size for size in lengths if size <= 3072]
    assert all(rows <= size for rows, size in enumerate(sizes))
    assert all(size < 1.5 * rows for rows, size in enumerate(sizes) if rows > 16)


@pytest.fixture(scope="module")
def rounded(loading):
    """Rows with runs and a discrepancy that are sampled, their problem and a draw."""
    rng, rows = np.random.default_rng(4), len(loading.force)
    records = replace(
        loading,
        force=np.round(200.0 * loading.deformation + rng.normal(0.0, 0.6, rows)),
        run=np.arange(rows) * 7 % 4,
        known=frozenset({"run", "temperature"}),
    )
    case = make_case(records, make_gear(resolution=1.0))
    form = replace(form_of(case, (), True), rounded=True, correlated=False)
    problem = build_problem(case, effect_priors(), structure=form)
    values = draw_truth(problem, jax.random.key(0))
    stiffness = 200.0 / (values["E0"] * problem.unit_stiffness)
    values |= {"K": stiffness, "sigma": np.float64(0.7), "alpha": np.float64(3e-4)}
    values |= {"force_offset": np.float64(0.3), "deformation_offset": np.float64(1e-3)}
    values |= {"run_offset": rng.normal(0.0, 1.0, 4)}
    values |= {"gap_weights": rng.normal(0.0, 0.3, problem.discrepancy.size)}
    return case, problem, values


def mean_of(case, problem, values) -> np.ndarray:
    records, gap = case.records, problem.discrepancy
    slope = values["K"] * values["E0"] * problem.unit_stiffness
    slope = slope * (1.0 - values["alpha"] * (records.temperature - 20.0))
    mean = slope * (records.deformation - values["deformation_offset"])
    mean = mean + values["force_offset"] + values["run_offset"][records.run]
    columns = np.asarray(gap.columns(records.deformation, records.sense))
    return mean + columns @ values["gap_weights"]


def test_the_likelihood_of_rounded_rows_is_that_of_the_measured_ones(rounded):
    case, problem, values = rounded
    assert len(problem.rows.force) > problem.count == len(case.records.force)
    error = case.records.force - mean_of(*rounded)
    # The difference of the smaller tails is the more exact one.
    low, high = (error - 0.5) / 0.7, (error + 0.5) / 0.7
    chance = np.where(
        error < 0.0,
        stats.norm.cdf(high) - stats.norm.cdf(low),
        stats.norm.sf(low) - stats.norm.sf(high),
    )
    found = float(jax.jit(Problem.log_likelihood)(problem, values))
    assert found == pytest.approx(np.log(chance).sum(), rel=1e-7)


def test_derivatives_are_those_of_the_measured_rows(rounded):
    case, problem, values = rounded
    found = linearise(problem, values, case.records)
    np.testing.assert_allclose(found.sd, np.hypot(0.7, 1.0 / np.sqrt(12.0)))
    for name in ("K", "E0", "alpha", "force_offset", "deformation_offset"):
        step = 1e-4 * abs(values[name])
        high, low = (
            mean_of(case, problem, values | {name: values[name] + move})
            for move in (step, -step)
        )
        slope = (high - low) / (2.0 * step)
        np.testing.assert_allclose(found.slopes[name], slope, rtol=1e-6, atol=1e-6)
    share = (np.asarray(case.records.run)[:, None] == np.arange(4)) - 0.25
    np.testing.assert_allclose(found.members[:, :4], values["run_offset_sd"] * share)
    np.testing.assert_allclose(
        found.scores[:4], values["run_offset"] / values["run_offset_sd"]
    )
