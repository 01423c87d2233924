"""Every check passes on a good model and trips on one made to trip it."""

import numpy as np
import pytest
from rigs import cycles, make_case, make_gear, make_records, ramp
from short import SHORT, TOO_SHORT

from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior, effect_priors
from hdcal.errors import NotUsable
from hdcal.inference.checks import (
    bound_check,
    conflict_check,
    rounding_check,
    sampling_checks,
)
from hdcal.inference.diagnostics import Convergence, diagnose_parameters, mixing
from hdcal.inference.identifiability import linearise, unidentified
from hdcal.inference.problem import build_problem
from hdcal.inference.sample import Draws
from hdcal.physics.registry import EFFECTS

RHAT, ESS, BFMI, DIVERGENT, DEPTH = range(5)


def honest_force(records, slope=205.0, offset=-1.0, sd=0.5, seed=0):
    noise = np.random.default_rng(seed).normal(0.0, sd, len(records.force))
    return slope * np.asarray(records.deformation) + offset + noise


def case_of(records, gear=None, **change):
    rows = {
        n: getattr(records, n) for n in vars(records) if n not in ("known", "force")
    }
    force = change.pop("force", honest_force(records))
    return make_case(make_records(**rows, force=force, known=records.known), gear)


@pytest.fixture(scope="module")
def good():
    return calibrate(case_of(ramp(40)), seed=1, **SHORT)


def outcome(posterior, start):
    return [c.outcome for c in posterior.checks if c.name.startswith(start)]


def stats_of(chains=4, draws=500, **change):
    rng = np.random.default_rng(0)
    fields = {
        "energy": rng.normal(size=(chains, draws)),
        "diverging": np.zeros((chains, draws), dtype=bool),
        "n_steps": np.full((chains, draws), 7),
    }
    nothing = np.zeros((chains, draws))
    fields |= {"values": {}, "potential": nothing, "acceptance": nothing}
    fields |= {"step_size": nothing, "target_acceptance": 0.8}
    return Draws(**(fields | change))


def diagnoses_of(draws):
    flat = np.zeros(draws.shape)
    prior = {"x": Prior("normal", (0.0, 10.0))}
    rng = np.random.default_rng(1)
    return diagnose_parameters({"x": draws}, prior, rng.normal(size=flat.shape), flat)


GOOD = np.random.default_rng(2).normal(size=(4, 500))


def test_a_good_run_passes_everything(good):
    assert good.usable
    assert {c.outcome for c in good.checks} <= {"passed", "note"}
    assert [c.outcome for c in sampling_checks(stats_of(), diagnoses_of(GOOD))] == [
        "passed"
    ] * 5


def test_chains_in_different_places_fail_rhat():
    apart = GOOD + np.array([0.0, 0.0, 0.0, 3.0])[:, None]
    assert sampling_checks(stats_of(), diagnoses_of(apart))[RHAT].outcome == "failed"


def test_chains_that_stand_still_fail_rhat():
    still = np.zeros_like(GOOD)
    assert sampling_checks(stats_of(), diagnoses_of(still))[RHAT].outcome == "failed"


def test_a_slow_walk_fails_the_effective_sample_size():
    walk = np.random.default_rng(3).normal(size=(4, 500)).cumsum(axis=1)
    assert sampling_checks(stats_of(), diagnoses_of(walk))[ESS].outcome == "failed"


def test_a_tail_that_is_hardly_visited_fails_the_tail_size():
    stuck = GOOD.copy()
    stuck[:, :40] = np.where(np.arange(4)[:, None] == 0, 30.0, stuck[:, :40])
    assert sampling_checks(stats_of(), diagnoses_of(stuck))[ESS].outcome == "failed"


def test_energy_that_creeps_fails_bfmi():
    energy = np.random.default_rng(4).normal(size=(4, 500)).cumsum(axis=1)
    checks = sampling_checks(stats_of(energy=energy), diagnoses_of(GOOD))
    assert checks[BFMI].outcome == "failed"


def test_one_divergence_fails():
    diverging = np.zeros((4, 500), dtype=bool)
    diverging[2, 17] = True
    checks = sampling_checks(stats_of(diverging=diverging), diagnoses_of(GOOD))
    assert checks[DIVERGENT].outcome == "failed"


def test_trajectories_that_are_cut_off_fail():
    steps = np.full((4, 500), 7)
    steps[:, ::50] = 1023
    checks = sampling_checks(stats_of(n_steps=steps), diagnoses_of(GOOD))
    assert checks[DEPTH].outcome == "failed"


def test_too_short_a_run_fails_closed():
    posterior = calibrate(case_of(ramp(40)), **TOO_SHORT)
    assert not posterior.usable
    assert posterior.reasons
    with pytest.raises(NotUsable):
        posterior.require_usable()


def test_a_force_in_the_wrong_unit_conflicts_with_the_prior(good):
    records = ramp(40)
    kilo = case_of(records, force=9.80665 * honest_force(records))
    assert outcome(good, "prior and data") == ["passed"]
    assert outcome(calibrate(kilo, **SHORT), "prior and data") == ["warning"]


def test_a_median_far_in_the_tail_is_a_conflict():
    prior = {"x": Prior("normal", (0.0, 1.0))}
    assert conflict_check({"x": GOOD + 2.5}, prior).outcome == "passed"
    assert conflict_check({"x": GOOD + 3.5}, prior).outcome == "warning"


def test_an_effect_far_from_its_prior_is_no_wrong_unit():
    prior = dict.fromkeys(("x", "outliers.ratio"), Prior("normal", (0.0, 1.0)))
    one = conflict_check({"outliers.ratio": GOOD + 4.0}, prior)
    assert one.outcome == "warning" and "a prior of its own" in one.words
    assert one.name == "prior and effects agree"
    both = conflict_check({"outliers.ratio": GOOD + 4.0, "x": GOOD + 4.0}, prior)
    assert "Is it a wrong unit" in both.words


def test_much_noise_alone_is_what_the_model_lacks_rather_than_a_unit():
    prior = {
        "sigma": Prior("lognormal", (0.1, 0.5)),
        "K": Prior("normal", (0.0, 1.0)),
    }
    own, ordinary = np.exp(0.01 * GOOD), GOOD
    much = conflict_check({"sigma": own, "K": ordinary}, prior)
    assert much.outcome == "warning" and "that the model lacks" in much.words
    assert "unit" not in much.words
    alike = prior | {"noise_correlation": Prior("beta", (1.0, 9.0))}
    told = {"noise_correlation": 0.99 + 1e-4 * GOOD, "sigma": own, "K": ordinary}
    words = conflict_check(told, alike).words
    assert "noise_correlation" in words and "that the model lacks" in words
    assert "Is it a wrong unit" in conflict_check(told | {"K": GOOD + 4.0}, alike).words
    little = conflict_check({"sigma": 0.001 * own, "K": ordinary}, prior)
    assert "Is it a wrong unit" in little.words
    both = conflict_check({"sigma": own, "K": ordinary + 4.0}, prior)
    assert "Is it a wrong unit" in both.words


def test_what_a_lognormal_prior_lost_counts_in_logarithms():
    """Far above its prior a parameter is as wide as that in N, but well known."""
    draws, prior = 15.0 * np.exp(0.1 * GOOD), Prior("lognormal", (5.0, 0.3))
    found = diagnose_parameters({"x": draws}, {"x": prior}, -draws, -draws)["x"]
    assert found.contraction == pytest.approx(1.0 - 0.1**2 * np.var(GOOD) / 0.3**2)
    assert found.driven_by == "data"


def test_a_prior_that_cuts_the_answer_off_is_a_bound(good):
    """Beyond K = 2.3 the likelihood still rises: the draws pile up below it."""
    wanted = np.random.default_rng(7).normal(2.5, 0.15, 40_000)
    cut = {"K": wanted[(wanted > 1.0) & (wanted < 2.3)][:2000].reshape(4, 500)}
    found = bound_check(cut, {"K": Prior("uniform", (1.0, 2.3))})
    assert found.outcome == "warning"
    assert "K at 2.3" in found.words
    assert bound_check(cut, {"K": Prior("uniform", (1.0, 4.0))}).outcome == "passed"
    assert outcome(good, "no parameter at a bound") == ["passed"]


@pytest.mark.thorough
def test_an_effect_that_is_absent_is_pressed_against_zero():
    absent = calibrate(case_of(cycles(96)), effects=["coulomb_friction"], **SHORT)
    assert outcome(absent, "no parameter at a bound") == ["warning"]
    records = cycles(96)
    force = honest_force(records) + 2.0 * np.asarray(records.sense)
    present = calibrate(
        case_of(records, force=force), effects=["coulomb_friction"], **SHORT
    )
    assert outcome(present, "no parameter at a bound") == ["passed"]


def test_an_absent_effect_is_no_conflict():
    """A half-normal prior expects a zero most of all; only its far end conflicts."""
    half = {"x": Prior("half_normal", (1.0,))}
    assert conflict_check({"x": np.abs(1e-5 * GOOD)}, half).outcome == "passed"
    assert conflict_check({"x": 4.0 + 0.1 * GOOD}, half).outcome == "warning"


def test_too_coarse_a_step_for_sheppard_fails():
    sigma = np.full((4, 500), 0.2)
    assert rounding_check(0.98, False, sigma).outcome == "failed"
    assert rounding_check(0.98, True, sigma).outcome == "passed"
    assert rounding_check(0.25, False, sigma).outcome == "passed"


def test_the_headline_must_have_mixed_too():
    apart = GOOD + np.array([0.0, 0.0, 0.0, 3.0])[:, None]
    mixed = diagnoses_of(GOOD) | mixing({"stiffness": apart})
    assert sampling_checks(stats_of(), mixed)[RHAT].outcome == "failed"


def test_bounds_see_pile_ups_only():
    half = {"x": Prior("half_normal", (1.0,))}
    assert bound_check({"x": np.abs(GOOD)}, half).outcome == "warning"
    assert bound_check({"x": np.abs(GOOD * 0.1 + 1.0)}, half).outcome == "passed"


def test_a_parameter_without_its_covariate_is_dead(good):
    words = [c.words for c in good.checks if c.outcome == "note"]
    assert "alpha: these data say nothing, the prior is the answer" in words
    assert good.diagnoses["alpha"].driven_by == "prior"
    records = cycles(960)
    warm = calibrate(case_of(records, force=honest_force(records, sd=0.1)), **SHORT)
    assert not any("alpha" in c.words for c in warm.checks if c.outcome == "note")
    assert warm.diagnoses["alpha"].driven_by == "data"


def test_flat_directions_are_named(good):
    words = [c.words for c in good.checks if c.outcome == "note"]
    pair = "K and E0 cannot be told apart by this data; their product can"
    assert any(w.startswith(f"{pair}, and with the prior of E0") for w in words)
    assert any("deformation_offset and force_offset" in sentence for sentence in words)


def test_a_known_modulus_is_no_flat_direction(good):
    known = {
        "E0": Prior("fixed", (207e3,)),
        "deformation_offset": Prior("fixed", (0.0,)),
    }
    centre = {name: np.median(values) for name, values in good.draws.items()}
    centre |= {name: prior.numbers[0] for name, prior in known.items()}
    found = {}
    for priors in ({}, known):
        case = case_of(ramp(40), make_gear(**priors))
        problem = build_problem(case, effect_priors())
        near = linearise(problem, centre, case.records)
        slopes = {name: slope / near.sd for name, slope in near.slopes.items()}
        _, found[len(priors)] = unidentified(slopes, problem)
    assert any("told apart by" in words for words in found[0])
    assert found[2] == []


def test_drivers_of_the_article_s_ramp(good):
    drivers = {name: d.driven_by for name, d in good.diagnoses.items()}
    assert drivers["E0"] == drivers["alpha"] == "prior"
    assert drivers["K"] == drivers["sigma"] == "data"


def test_power_scaling_overrules_a_middling_contraction():
    """Contraction .85, likelihood without influence: the prior drives."""
    rng = np.random.default_rng(6)
    draws = 0.39 * rng.normal(size=(4, 1000))
    prior = {"x": Prior("normal", (0.0, 1.0))}
    of_prior, none = -50.0 * draws**2, 1e-3 * rng.normal(size=draws.shape)
    weak = diagnose_parameters({"x": draws}, prior, of_prior, none)["x"]
    strong = diagnose_parameters({"x": draws}, prior, none, of_prior)["x"]
    assert isinstance(weak, Convergence)
    assert (weak.driven_by, strong.driven_by) == ("prior", "data")


def test_what_moves_no_mean_is_not_called_unseen():
    """A part of the noise has no slope in the mean, yet the data see it."""
    case = case_of(ramp(40))
    chosen = (EFFECTS["heteroscedastic_noise"], EFFECTS["outliers"])
    problem = build_problem(case, effect_priors(), chosen)
    values = {n: prior.numbers[0] for n, prior in problem.priors.items()}
    slopes = linearise(problem, values, case.records).slopes
    assert set(slopes) == {"K", "E0", "alpha", "force_offset", "deformation_offset"}
