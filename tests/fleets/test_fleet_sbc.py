"""Populations, gears and gears to come are calibrated: ranks of the truth are uniform.

Simulation-based calibration (Talts et al. 2018): populations drawn from the prior,
gears from these, readings from the gears.
"""

from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import draw_truth, make_gear
from scipy import stats

import hdcal
from hdcal.data.case import Case
from hdcal.fleets.fleet_problem import fleet_problem
from hdcal.fleets.readings import fleet_readings

X, RUNS = np.linspace(0.05, 0.5, 6), 2
BINS = 10
# False-alarm probability of each test of one quantity; the seeds are fixed.
LEVEL = 1e-3
COVERAGES = (0.5, 0.9, 0.95)
_GEAR = make_gear(theory="ring")


def _case(gears: int, force: np.ndarray) -> Case:
    """Return readings; forces of shape (gear, run, row)."""
    names = np.array([f"G{gear}" for gear in range(gears)])
    gear, run, row = (index.ravel() for index in np.indices(force.shape))
    table = {"specimen": names[gear], "run": run, "deformation_mm": X[row]}
    case = hdcal.read_case(table | {"force_N": force.ravel()}, theory="spring")
    return replace(case, gear=_GEAR)


def simulate(gears: int, truth: dict, rng: np.random.Generator):
    """Return readings, the first gear's stiffness and noise, and a next gear's."""
    off = rng.random(gears + 1) < truth["off_share"]
    wide = np.sqrt(1.0 + off * truth["off_ratio"] ** 2)
    apart = truth["specimen_sd"] * wide * rng.standard_normal(gears + 1)
    stiffness = truth["stiffness"] * (1.0 + apart)
    noise = truth["sigma"] * np.exp(
        truth["noise_spread"] * rng.standard_normal(gears + 1)
    )
    zero = truth["zero"] + truth["run_offset_sd"] * rng.standard_normal((gears, RUNS))
    force = stiffness[:gears, None, None] * X + zero[..., None]
    force = force + noise[:gears, None, None] * rng.standard_normal(force.shape)
    return _case(gears, force), stiffness[0], stiffness[gears]


def ranks_of(gears: int, fleets: int) -> dict[str, np.ndarray]:
    """Return the share of draws below the truth, of each quantity in each fleet."""
    template, _ = fleet_problem(fleet_readings(_case(gears, _ramp(gears))))
    found: dict[str, list[float]] = {}
    for index in range(fleets):
        rng = np.random.default_rng([gears, index])
        truth = draw_truth(template, jax.random.key(1000 * gears + index))
        case, first, coming = simulate(gears, truth, rng)
        fleet = hdcal.fleet(case, seed=index)
        assert not fleet.reasons, (index, fleet.reasons)
        draws = {name: (v, truth[name]) for name, v in fleet.draws.items()}
        draws["first gear"] = fleet.stiffness[:, 0], first
        draws["next gear"] = fleet.next_stiffness, coming
        for name, (values, true) in draws.items():
            found.setdefault(name, []).append(float(np.mean(values < true)))
    return {name: np.array(values) for name, values in found.items()}


def _ramp(gears: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    return 200.0 * X + rng.normal(0.0, 0.3, (gears, RUNS, len(X)))


def uniformity(ranks: np.ndarray) -> float:
    """Return the p value of Kolmogorov's and of a χ² test, the smaller one doubled."""
    counts, _ = np.histogram(ranks, bins=BINS, range=(0.0, 1.0))
    alike = stats.kstest(ranks, "uniform").pvalue, stats.chisquare(counts).pvalue
    return min(1.0, 2.0 * float(min(alike)))


def assert_calibrated(ranks: dict[str, np.ndarray]) -> None:
    worst = {name: uniformity(own) for name, own in ranks.items()}
    assert min(worst.values()) > LEVEL, worst
    for name, own in ranks.items():
        for level in COVERAGES:
            inside = int(np.sum(abs(own - 0.5) < 0.5 * level))
            p = stats.binomtest(inside, len(own), level).pvalue
            assert p > LEVEL, (name, level, inside / len(own))


@pytest.mark.thorough
def test_a_slice_of_fleets():
    assert_calibrated(ranks_of(10, 20))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gears", "fleets"), [(5, 200), (10, 200), (30, 200), (300, 200)]
)
def test_fleets_of_any_size(gears: int, fleets: int):
    assert_calibrated(ranks_of(gears, fleets))


@pytest.mark.parametrize("fault", ["too narrow", "shifted"])
def test_what_is_not_calibrated_is_flagged(fault: str):
    rng = np.random.default_rng(1)
    fair = rng.uniform(size=200)
    assert_calibrated({"fair": fair})
    score = stats.norm.ppf(fair)
    broken = 1.5 * score if fault == "too narrow" else score + 0.5
    with pytest.raises(AssertionError, match="broken"):
        assert_calibrated({"broken": stats.norm.cdf(broken)})
