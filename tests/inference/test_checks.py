"""Every check passes on a good model and trips on one made to trip it."""

import numpy as np
import pytest
from rigs import make_case, make_gear, make_records, ramp
from short import SHORT

from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior, effect_priors
from hdcal.inference.checks import (
    NOISY,
    PLAUSIBLE,
    bound_check,
    conflict_check,
    correlation_check,
    rounding_check,
    sampling_checks,
)
from hdcal.inference.diagnostics import (
    diagnose_parameters,
    have_mixed,
    mixing,
    pareto_shape,
)
from hdcal.inference.force_model.identifiability import identification_checks, linearise
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.sample import Draws
from hdcal.physics.registry import EFFECTS

CHAINS, DRAWS = 4, 500
RHAT, ESS, BFMI, DIVERGENT = range(4)
GOOD = np.random.default_rng(2).normal(size=(CHAINS, DRAWS))
APART = GOOD + np.array([0.0, 0.0, 0.0, 3.0])[:, None]
WALK = np.random.default_rng(3).normal(size=(CHAINS, DRAWS)).cumsum(axis=1)
ONE_DIVERGED = (np.arange(CHAINS * DRAWS) == 17).reshape(CHAINS, DRAWS)
FIRST = (np.arange(CHAINS)[:, None] == 0) & (np.arange(DRAWS) < 40)


def ramp_case(gear=None):
    records = ramp(40)
    noise = np.random.default_rng(0).normal(0.0, 0.5, 40)
    force = 205.0 * records.deformation - 1.0 + noise
    return make_case(make_records(records.deformation, force), gear)


@pytest.fixture(scope="module")
def good():
    return calibrate(ramp_case(), seed=1, **SHORT)


def run_of(**change) -> Draws:
    statistics = {
        "energy": np.random.default_rng(0).normal(size=(CHAINS, DRAWS)),
        "diverging": np.zeros((CHAINS, DRAWS), bool),
    }
    return Draws({}, statistics | change, 0.8)


@pytest.mark.parametrize(
    ("failed", "change", "draws"),
    [
        (None, {}, GOOD),
        (RHAT, {}, APART),
        (RHAT, {}, np.zeros_like(GOOD)),
        (ESS, {}, WALK),
        (ESS, {}, np.where(FIRST, 30.0, GOOD)),
        (BFMI, {"energy": WALK}, GOOD),
        (DIVERGENT, {"diverging": ONE_DIVERGED}, GOOD),
    ],
)
def test_a_fault_of_the_sampler_fails(failed, change, draws):
    checks = sampling_checks(run_of(**change), mixing({"good": GOOD, "x": draws}))
    outcomes = [check.outcome for check in checks]
    if failed is None:
        assert outcomes == ["passed"] * 4
    else:
        assert outcomes[failed] == "failed"


def test_a_good_calibration_passes_everything(good):
    assert good.usable
    assert {check.outcome for check in good.checks} <= {"passed", "note"}
    drivers = {name: found.driven_by for name, found in good.diagnoses.items()}
    assert drivers["E0"] == drivers["alpha"] == "prior"
    assert drivers["K"] == drivers["sigma"] == "data"


NORMAL, HALF = Prior("normal", (0.0, 1.0)), Prior("half_normal", (1.0,))
NOISE = Prior("lognormal", (0.1, 0.5))


@pytest.mark.parametrize(
    ("draws", "name"),
    [
        ({"x": (NORMAL, GOOD + 2.5)}, None),
        ({"x": (NORMAL, GOOD + 3.5)}, PLAUSIBLE),
        # An effect that is absent is expected, its far end is not.
        ({"x": (HALF, np.abs(1e-5 * GOOD))}, None),
        ({"x": (HALF, 4.0 + 0.1 * GOOD)}, PLAUSIBLE),
        ({"outliers.ratio": (NORMAL, GOOD + 4.0)}, "prior and effects agree"),
        (
            {"outliers.ratio": (NORMAL, GOOD + 4.0), "x": (NORMAL, GOOD + 4.0)},
            PLAUSIBLE,
        ),
        # Much noise alone is what the model lacks rather than a wrong unit.
        ({"sigma": (NOISE, np.exp(0.01 * GOOD)), "K": (NORMAL, GOOD)}, NOISY),
        ({"sigma": (NOISE, 1e-3 * np.exp(0.01 * GOOD))}, PLAUSIBLE),
    ],
)
def test_a_median_far_in_the_tail_is_a_conflict(draws, name):
    priors = {key: prior for key, (prior, _) in draws.items()}
    found = conflict_check({key: each for key, (_, each) in draws.items()}, priors)
    expected = (PLAUSIBLE, "passed") if name is None else (name, "warning")
    assert (found.name, found.outcome) == expected


def test_a_prior_that_cuts_the_answer_off_is_a_bound():
    """Beyond K = 2.3 the likelihood still rises: the draws pile up below it."""
    wanted = np.random.default_rng(7).normal(2.5, 0.15, 40_000)
    cut = {"K": wanted[(wanted > 1.0) & (wanted < 2.3)][:2000].reshape(4, 500)}
    found = bound_check(cut, {"K": Prior("uniform", (1.0, 2.3))})
    assert found.outcome == "warning" and "K at 2.3" in found.words
    assert bound_check(cut, {"K": Prior("uniform", (1.0, 4.0))}).outcome == "passed"
    for draws, outcome in ((GOOD, "warning"), (0.1 * GOOD + 1.0, "passed")):
        assert bound_check({"x": np.abs(draws)}, {"x": HALF}).outcome == outcome


@pytest.mark.parametrize(
    ("step", "exact", "outcome"),
    [(0.98, False, "failed"), (0.98, True, "passed"), (0.25, False, "passed")],
)
def test_too_coarse_a_step_for_sheppard_fails(step, exact, outcome):
    sigma = np.full((CHAINS, DRAWS), 0.2)
    assert rounding_check(step, exact, sigma).outcome == outcome


@pytest.mark.parametrize(
    ("rho", "rows", "outcome"),
    [(0.01, 60, "passed"), (0.4, 60, "note"), (0.8, 60, "warning"), (0.8, 600, "note")],
)
def test_a_correlation_is_reported_by_what_it_leaves(rho, rows, outcome):
    priors = {CORRELATION: Prior("uniform", (0.0, 0.95))}
    found = correlation_check({CORRELATION: np.full((2, 50), rho)}, rows, priors)
    assert found.outcome == outcome
    # (60 − 58 ρ) / (1 + ρ) independent readings.
    assert ("some 8 independent" in found.words) == (outcome == "warning")


def test_a_correlation_at_the_end_of_its_prior_asks_for_a_diagnosis():
    """There the errors last longer than noise does: they are a curve or a loop."""
    draws = {CORRELATION: np.linspace(0.9295, 0.93, 100).reshape(2, 50)}
    for end, asks in ((0.93, True), (0.99, False)):
        priors = {CORRELATION: Prior("uniform", (0.0, end))}
        words = correlation_check(draws, 60, priors).words
        assert ("diagnose" in words) == asks
        assert ("0.93 to 0.93" in words) != asks


def test_what_a_lognormal_prior_lost_counts_in_logarithms():
    """Far above its prior a parameter is as wide as that in N, but well known."""
    draws = 15.0 * np.exp(0.1 * GOOD)
    found = diagnose_parameters({"x": draws}, {"x": Prior("lognormal", (5.0, 0.3))})[
        "x"
    ]
    assert found.contraction == pytest.approx(1.0 - 0.1**2 * np.var(GOOD) / 0.3**2)
    assert found.driven_by == "data"


def test_what_data_and_priors_leave_open_is_listed(good):
    values = {name: np.median(draws) for name, draws in good.draws.items()}
    fixed = {
        "E0": Prior("fixed", (207e3,)),
        "deformation_offset": Prior("fixed", (0.0,)),
    }
    found = []
    for priors in ({}, fixed):
        case = ramp_case(make_gear(**priors))
        problem = build_problem(case, effect_priors())
        given = values | {name: prior.numbers[0] for name, prior in priors.items()}
        slopes = linearise(problem, given, case.records).sensitivities()
        checks = identification_checks(slopes, problem.priors)
        found.append([c.words for c in checks if c.outcome == "note"])
    # At one temperature α moves nothing, and K is known by the prior of E₀ only.
    assert [words.split()[0] for words in found[0]] == [
        "alpha:",
        "K",
        "force_offset",
    ]
    assert found[0][1].startswith("K and E0 ")
    assert found[0][2].startswith("force_offset and deformation_offset ")
    assert [words.split()[0] for words in found[1]] == ["alpha:"]


def test_a_flat_direction_of_three_parameters_is_named():
    """Any two of them are determined, the three together are not."""
    rng = np.random.default_rng(3)
    one, other = rng.normal(size=(2, 40))
    slopes = {"a": one, "b": other, "c": one + other, "d": rng.normal(size=40)}
    priors = {name: Prior("normal", (0.0, 1.0)) for name in slopes}
    notes = [
        c.words for c in identification_checks(slopes, priors) if c.outcome == "note"
    ]
    assert len(notes) == 1 and notes[0].startswith("a, b and c ")


def test_parts_of_the_noise_have_no_slope_in_the_mean():
    chosen = (EFFECTS["heteroscedastic_noise"], EFFECTS["outliers"])
    case = ramp_case()
    problem = build_problem(case, effect_priors(), chosen)
    values = {name: prior.numbers[0] for name, prior in problem.priors.items()}
    slopes = linearise(problem, values, case.records).slopes
    assert {*slopes} == {"K", "E0", "alpha", "force_offset", "deformation_offset"}


@pytest.mark.parametrize(
    "bad",
    [
        GOOD + np.arange(4)[:, None],
        np.ones_like(GOOD),
        np.where(GOOD > 3.0, np.nan, GOOD),
        np.where(np.arange(4)[:, None] == 3, 3.0 * GOOD, GOOD),
        GOOD[:1],
    ],
)
def test_what_has_not_mixed_is_flagged(bad):
    assert have_mixed({"good": GOOD})
    assert not have_mixed({"good": GOOD[: len(bad), : bad.shape[1]], "bad": bad})


@pytest.mark.parametrize("shape", [0.3, 0.5, 0.9])
def test_the_tail_of_weights_has_its_pareto_shape(shape: float):
    rng = np.random.default_rng(4)
    weight = np.random.default_rng(4).pareto(1.0 / shape, 100_000) + 1.0
    assert pareto_shape(weight) == pytest.approx(shape, abs=0.1)
    few = np.where(np.arange(100_000) < 50, rng.random(100_000), 0.0)
    assert pareto_shape(few) == np.inf
