"""Populations, gears and gears to come are calibrated: ranks of the truth are uniform.

Simulation-based calibration (Talts et al. 2018): populations drawn from the prior,
lots, operators, rigs and gears from these, readings from the gears.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import draw_truth, make_gear
from scipy import stats

import hdcal
from hdcal.data.case import Case
from hdcal.fleets.fleet_problem import fleet_problem
from hdcal.fleets.population_problem import PopulationProblem
from hdcal.fleets.readings import fleet_readings

X, RUNS = np.linspace(0.05, 0.5, 6), 2
BINS = 10
# False-alarm probability of each test of one quantity; the seeds are fixed.
LEVEL = 1e-3
COVERAGES = (0.5, 0.9, 0.95)
# Share of fleets with groups that may fail their checks.
MOST_FAILED = 0.05
# Whose scatter that of groups is a multiple of, and which groups there are: four lots,
# three operators, and two rigs of which each reads two gears in three alone.
MEMBERS = {"rig": "specimen_sd", "lot": "specimen_sd", "operator": "run_offset_sd"}
GROUPS = {
    "rig": lambda gear, run: (gear + run * (gear % 3 == 0)) % 2,
    "lot": lambda gear, run: gear // 2 % 4,
    "operator": lambda gear, run: (gear + run) % 3,
}
_GEAR = make_gear(theory="ring")


def _case(force: np.ndarray, told: Sequence[str]) -> Case:
    """Return readings; forces of shape (gear, run, row)."""
    names = np.array([f"G{gear}" for gear in range(len(force))])
    gear, run, row = (index.ravel() for index in np.indices(force.shape))
    table = {"specimen": names[gear], "run": run, "deformation_mm": X[row]}
    table |= {kind: GROUPS[kind](gear, run).astype(str) for kind in told}
    # The priors also hold stiffnesses about which the screening would ask.
    rising = {"force_N": _ramp(len(force)).ravel()}
    case = hdcal.read_case(table | rising, theory="spring")
    records = replace(case.records, force=force.ravel())
    return replace(case, records=records, gear=_GEAR)


def simulate(
    problem: PopulationProblem, gears: int, truth: dict, rng: np.random.Generator
):
    """Return readings, the first gear's stiffness and a next gear's.

    What groups are drawn is added to the truth.
    """
    offsets = {}
    for kind, told in problem.groups.items():
        sd = truth[f"{kind}_ratio"] * truth[MEMBERS[kind]]
        contrasts = sd * rng.standard_normal(told.basis.shape[1])
        offsets[kind] = told.basis @ contrasts
        truth |= {f"{kind}_{k}": v for k, v in enumerate(offsets[kind], start=1)}
        truth[f"{kind}_sd"] = sd
    gear, run = np.indices((gears, RUNS))

    def of(kind):
        if kind not in offsets:
            return 0.0 * gear
        return offsets[kind][GROUPS[kind](gear, run)]

    off = rng.random(gears + 1) < truth["off_share"]
    own = truth["specimen_sd"] * np.sqrt(1.0 + off * truth["off_ratio"] ** 2)
    apart = own[:gears] * rng.standard_normal(gears)
    stiffness = truth["stiffness"] * (1.0 + of("lot")[:, 0]) * (1.0 + apart)
    # The next gear's lot is a new one; the centre is of those measured.
    lots = truth.get("lot_sd", 0.0) * np.sqrt(1.0 + 1.0 / len(offsets.get("lot", "1")))
    coming = 1.0 + np.hypot(own[gears], lots) * rng.standard_normal()
    noise = truth["noise_spread"] * rng.standard_normal(gears)
    noise = truth["sigma"] * np.exp(noise)
    mounted = truth["run_offset_sd"] * rng.standard_normal((gears, RUNS))
    slope = stiffness[:, None] * (1.0 + of("rig"))
    zero = truth["zero"] + of("operator") + mounted
    force = slope[..., None] * X + zero[..., None]
    force = force + noise[:, None, None] * rng.standard_normal(force.shape)
    case = _case(force, tuple(problem.groups))
    return case, stiffness[0], truth["stiffness"] * coming


def ranks_of(gears: int, fleets: int, *told: str) -> dict[str, np.ndarray]:
    """Return the share of draws below the truth, of each quantity in each fleet.

    The priors also tell of lots so far apart that a stiffness is negative; chains in
    such a fleet may fail. It is left out: as its data alone decide that, ranks in all
    others stay uniform.
    """
    template, _ = fleet_problem(fleet_readings(_case(_ramp(gears), told)))
    assert tuple(template.groups) == told
    found: dict[str, list[float]] = {}
    failed = 0
    for index in range(fleets):
        rng = np.random.default_rng([gears, len(told), index])
        truth = draw_truth(template, jax.random.key(1000 * gears + index))
        case, first, coming = simulate(template, gears, truth, rng)
        fleet = hdcal.fleet(case, seed=index)
        if fleet.reasons:
            failed += 1
            continue
        draws = {name: (v, truth[name]) for name, v in fleet.draws.items()}
        draws["first gear"] = fleet.stiffness[:, 0], first
        draws["next gear"] = fleet.next_stiffness, coming
        for name, (values, true) in draws.items():
            found.setdefault(name, []).append(float(np.mean(values < true)))
    assert failed <= (max(MOST_FAILED * fleets, 1.0) if told else 0.0)
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


@pytest.mark.thorough
def test_a_slice_of_fleets_with_groups():
    assert_calibrated(ranks_of(12, 12, *MEMBERS))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gears", "fleets"), [(5, 200), (10, 200), (30, 200), (300, 200)]
)
def test_fleets_of_any_size(gears: int, fleets: int):
    assert_calibrated(ranks_of(gears, fleets))


@pytest.mark.slow
@pytest.mark.parametrize("told", [("lot", "operator"), ("rig",), tuple(MEMBERS)])
def test_fleets_with_groups(told: tuple[str, ...]):
    assert_calibrated(ranks_of(16, 200, *told))


@pytest.mark.parametrize("fault", ["too narrow", "shifted"])
def test_what_is_not_calibrated_is_flagged(fault: str):
    rng = np.random.default_rng(1)
    fair = rng.uniform(size=200)
    assert_calibrated({"fair": fair})
    score = stats.norm.ppf(fair)
    broken = 1.5 * score if fault == "too narrow" else score + 0.5
    with pytest.raises(AssertionError, match="broken"):
        assert_calibrated({"broken": stats.norm.cdf(broken)})
