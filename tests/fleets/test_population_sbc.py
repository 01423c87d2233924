"""Populations and gears are calibrated: ranks of the truth are uniform.

Simulation-based calibration (Talts et al. 2018): populations drawn from the prior,
lots, operators, rigs and gears from these, readings from the gears.
"""

import numpy as np
import pytest
from gear_rows import RUNS, GearRows, X, ordinary
from scipy import stats
from scipy.linalg import helmert

from hdcal.data.prior import Prior
from hdcal.fleets.model import quantities as priors
from hdcal.fleets.model.population import Sampling, fit_population

# False-alarm probability of each test of one quantity; the seeds are fixed.
LEVEL = 1e-3
COVERAGES = (0.5, 0.9, 0.95)
# Share of fleets that may fail the checks of the sampler.
MOST_FAILED = 0.02
# Group, number of groups, quantity whose scatter theirs is a multiple of, and the
# group of a gear and a run: every third gear is measured on both rigs.
GROUPS = {
    "lot": (4, "specimen_sd", lambda gear, run: gear // 2 % 4),
    "rig": (2, "specimen_sd", lambda gear, run: (gear + run * (gear % 3 == 0)) % 2),
    "operator": (3, "run_offset_sd", lambda gear, run: (gear + run) % 3),
}


def draw(prior: Prior, rng: np.random.Generator) -> float:
    first, *rest = map(float, prior.numbers)
    if prior.family == "lognormal":
        return first * np.exp(rest[0] * rng.standard_normal())
    if prior.family == "beta":
        return rng.beta(first, *rest)
    assert prior.family == "half_normal"
    return abs(first * rng.standard_normal())


def population(rng: np.random.Generator) -> dict[str, float]:
    """Return the truth of a population.

    The centres are drawn from narrower distributions than their wide priors, which the
    data overrule.
    """
    case = ordinary(3, rng).readings(rng).case
    _, own = priors.population_priors(case)
    truth = {
        "stiffness": 200.0 * np.exp(0.3 * rng.standard_normal()),
        "zero": 5.0 * rng.standard_normal(),
        "sigma": 0.45 * np.exp(0.8 * rng.standard_normal()),
        "specimen_sd": draw(own["specimen_sd"], rng),
        "run_offset_sd": draw(own["run_offset_sd"], rng),
        "noise_spread": draw(priors.NOISE_SPREAD, rng),
        "off_share": draw(priors.ODD_STIFFNESS, rng),
        "off_ratio": draw(priors.ODD_RATIO, rng),
    }
    largest = truth["stiffness"] * X.max()
    for name in ("loop", "bend"):
        centre, spread = priors.shape_priors(largest)
        truth[name] = float(centre.numbers[1]) * rng.standard_normal()
        truth[f"{name}_spread"] = draw(spread, rng)
    for name in ("zero", "noise", "loop", "bend"):
        truth[f"{name}_off_share"] = draw(priors.ODD, rng)
        truth[f"{name}_off_ratio"] = draw(priors.ODD_RATIO, rng)
    return truth


def gears_of(truth: dict, gears: int, kinds: tuple[str, ...], rng) -> GearRows:
    """Return gears of a population; the groups are added to the truth."""
    gear, run = np.indices((gears, RUNS))
    offset = dict.fromkeys(GROUPS, np.zeros((gears, RUNS)))
    labels = {}
    for kind in kinds:
        count, member, group_of = GROUPS[kind]
        truth[f"{kind}_ratio"] = draw(priors.GROUP_RATIO, rng)
        truth[f"{kind}_sd"] = truth[f"{kind}_ratio"] * truth[member]
        contrasts = truth[f"{kind}_sd"] * rng.standard_normal(count - 1)
        each = helmert(count).T @ contrasts
        truth |= {f"{kind}_{k}": value for k, value in enumerate(each, start=1)}
        group = group_of(gear, run)
        offset[kind] = each[group]
        names = group[:, 0] if kind == "lot" else group.ravel()
        labels[f"{kind}s"] = [str(name) for name in names]

    def apart(quantity: str, spread: float, own: float) -> np.ndarray:
        odd = rng.random(gears) < truth[f"{quantity}off_share"]
        far = np.hypot(own, odd * truth[f"{quantity}off_ratio"])
        return spread * far * rng.standard_normal(gears)

    mounted = truth["run_offset_sd"] * rng.standard_normal((gears, RUNS))
    zero = apart("zero_", truth["run_offset_sd"], 0.0)[:, None] + mounted
    lots = 1.0 + offset["lot"][:, 0]
    relative = 1.0 + apart("", truth["specimen_sd"], 1.0)
    return GearRows(
        stiffness=truth["stiffness"] * lots * relative,
        zero=truth["zero"] + offset["operator"] + zero,
        noise=truth["sigma"] * np.exp(apart("noise_", truth["noise_spread"], 1.0)),
        loop=truth["loop"] + apart("loop_", truth["loop_spread"], 1.0),
        bend=truth["bend"] + apart("bend_", truth["bend_spread"], 1.0),
        gain=offset["rig"],
        labels=labels,
    )


def ranks_of(gears: int, fleets: int, *kinds: str) -> dict[str, np.ndarray]:
    """Return the share of draws below the truth, of each quantity in each fleet."""
    found: dict[str, list[float]] = {}
    failed: list[int] = []
    for index in range(fleets):
        rng = np.random.default_rng([gears, len(kinds), index])
        truth = population(rng)
        rows = gears_of(truth, gears, kinds, rng)
        fitted = fit_population(rows.readings(rng), Sampling(seed=index))
        if [one for one in fitted.checks if one.outcome == "failed"]:
            # The data alone decide that: the ranks in the others stay uniform.
            failed.append(index)
            continue
        draws = {name: (v, truth[name]) for name, v in fitted.draws.items()}
        draws["first gear"] = fitted.stiffness[:, 0], rows.stiffness[0]
        far = int(np.argmax(np.abs(rows.stiffness - np.median(rows.stiffness))))
        draws["farthest gear"] = fitted.stiffness[:, far], rows.stiffness[far]
        for name, (values, true) in draws.items():
            found.setdefault(name, []).append(float(np.mean(values < true)))
    assert len(failed) <= MOST_FAILED * fleets, failed
    return {name: np.array(values) for name, values in found.items()}


def assert_calibrated(ranks: dict[str, np.ndarray]) -> None:
    for name, own in ranks.items():
        counts, _ = np.histogram(own, bins=10, range=(0.0, 1.0))
        alike = stats.kstest(own, "uniform").pvalue, stats.chisquare(counts).pvalue
        assert 2.0 * min(alike) > LEVEL, (name, alike)
        for level in COVERAGES:
            inside = int(np.sum(abs(own - 0.5) < 0.5 * level))
            p = stats.binomtest(inside, len(own), level).pvalue
            assert p > LEVEL, (name, level, inside / len(own))


@pytest.mark.thorough
@pytest.mark.parametrize("kinds", [(), tuple(GROUPS)])
def test_a_slice_of_fleets(kinds: tuple[str, ...]):
    assert_calibrated(ranks_of(12, 20, *kinds))


@pytest.mark.slow
@pytest.mark.parametrize("gears", [5, 10, 30, 300])
def test_fleets_of_any_size(gears: int):
    assert_calibrated(ranks_of(gears, 200))


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [("lot", "operator"), ("rig",), tuple(GROUPS)])
def test_fleets_with_groups(kinds: tuple[str, ...]):
    assert_calibrated(ranks_of(16, 200, *kinds))


@pytest.mark.parametrize("fault", ["too narrow", "shifted"])
def test_ranks_that_are_not_calibrated_are_flagged(fault: str):
    fair = np.random.default_rng(1).uniform(size=200)
    assert_calibrated({"fair": fair})
    score = stats.norm.ppf(fair)
    broken = 1.5 * score if fault == "too narrow" else score + 0.5
    with pytest.raises(AssertionError, match="broken"):
        assert_calibrated({"broken": stats.norm.cdf(broken)})
