"""What takes the energy of a swing is named, or it is said that it cannot be told."""

from dataclasses import replace

import numpy as np
import pytest
from arviz_base import from_dict
from moving import TRUTH, frictional_case, moving_case, moving_gear

from hdcal import InputError, Prior, calibrate_dynamic, respond
from hdcal.inference import laplace, posterior_file
from hdcal.inference.checks import Check
from hdcal.inference.distributions import frozen
from hdcal.inference.dynamic_posterior import DynamicPosterior, load_any
from hdcal.inference.dynamic_problem import (
    FRICTION,
    build_dynamic,
    dynamic_site_priors,
)
from hdcal.motion import loss
from hdcal.motion.document import headline, loss_words, next_steps
from hdcal.motion.dynamic_calibration import highest_peak
from hdcal.motion.summary import dynamic_answer, found_loss

pytestmark = pytest.mark.computes

# Enough to look at, far too few for their checks.
FEW = {"chains": 2, "warmup": 100, "draws": 50}
# Damping ratio and friction [N] of each truth, and the model that holds it.
TRUTHS = {
    "viscous": (0.02, 0.0),
    "dry friction": (0.0, 2.0),
    "both": (0.01, 1.0),
}


def chosen(case, effects=None) -> loss.Chosen:
    """Return the model that would be sampled."""
    linear = build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")
    mode, _ = highest_peak(linear)
    return loss.choose_loss(case, "ring", linear, mode, effects)


def at_mode(found: loss.Chosen, name: str) -> float:
    """Return a parameter where the density is highest."""
    return float(laplace.values_at(found.problem, found.whitening.centre)[name])


@pytest.fixture
def always(monkeypatch):
    """Weigh also where the linear model leaves noise."""
    monkeypatch.setattr(loss, "NOISE", 2.0)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("viscous", marks=pytest.mark.slow),
        pytest.param("dry friction", marks=pytest.mark.slow),
        "both",
    ],
)
def test_a_loss_is_named(name: str, always):
    ratio, friction = TRUTHS[name]
    found = chosen(frictional_case(100, ratio, friction))
    assert found.probabilities[name] >= 0.9
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    # What is sampled unasked is the linear model.
    assert found.problem.effects == ()
    assert [check.outcome for check in found.checks] == ["passed"]


def test_friction_that_was_asked_for_is_found():
    found = chosen(frictional_case(100, *TRUTHS["both"]), ["coulomb_friction"])
    assert at_mode(found, "damping_ratio") == pytest.approx(0.01, rel=0.1)
    assert at_mode(found, FRICTION) == pytest.approx(1.0, rel=0.05)


def test_an_evidence_without_the_priors_breadth_is_told_by_a_wrong_name(
    monkeypatch, always
):
    evidence = laplace.log_evidence

    def without(problem, found):
        """Take friction as believed to within what the data resolve."""
        if not problem.effects:
            return evidence(problem, found)
        size = float(laplace.values_at(problem, found.centre)[FRICTION])
        prior = frozen(problem.priors[FRICTION]).logpdf(size)
        return evidence(problem, found) - prior - np.log(problem.units[FRICTION])

    monkeypatch.setattr(laplace, "log_evidence", without)
    found = chosen(frictional_case(100, *TRUTHS["viscous"]))
    assert found.probabilities["viscous"] < 0.9


@pytest.mark.slow
def test_names_of_many_records():
    wrong = told = 0
    for seed in range(200, 215):
        for name, (ratio, friction) in TRUTHS.items():
            shares = chosen(frictional_case(seed, ratio, friction)).probabilities
            shares = shares or {"viscous": 1.0}
            likeliest = max(shares, key=lambda n: shares[n])
            told += shares[likeliest] >= 0.9
            wrong += shares[likeliest] >= 0.9 and likeliest != name
    assert told >= 36 and wrong <= 1, (told, wrong)


def test_long_records_keep_the_linear_model_and_say_so(monkeypatch):
    monkeypatch.setattr(loss, "MOST_ROWS", 100)
    found = chosen(frictional_case(0, *TRUTHS["both"]))
    assert found.problem.effects == () and not found.probabilities
    assert [check.outcome for check in found.checks] == ["note"]
    assert "200, all damping counts as viscous" in found.checks[0].words


def test_where_the_linear_model_leaves_noise_nothing_is_weighed():
    found = chosen(moving_case(0))
    assert found.problem.effects == () and not found.probabilities and not found.checks
    frictional = chosen(frictional_case(0, *TRUTHS["both"]), [])
    values = laplace.values_at(frictional.problem, frictional.whitening.centre)
    assert loss.noise_probability(frictional.problem, values) < 1e-3


def test_without_effects_nothing_is_weighed():
    found = chosen(moving_case(0), [])
    assert found.problem.effects == () and not found.probabilities and not found.checks


def test_an_effect_that_the_model_does_not_hold_is_refused():
    with pytest.raises(InputError, match="does not hold 'hysteresis'"):
        calibrate_dynamic(moving_case(0), effects=["hysteresis", "coulomb_friction"])


@pytest.mark.slow
def test_a_stated_friction_of_any_family_is_taken():
    gear = moving_gear()
    for prior in (Prior("fixed", (1.0,), "N"), Prior("uniform", (0.5, 3.0), "N")):
        stated = replace(gear, effect_priors={FRICTION: prior})
        case = frictional_case(0, 0.01, 1.0, stated)
        found = chosen(case, ["coulomb_friction"])
        assert at_mode(found, FRICTION) == pytest.approx(1.0, rel=0.05)


@pytest.fixture(scope="module")
def posterior() -> DynamicPosterior:
    """A calibration with friction whose draws are made about the mode, none sampled."""
    case = frictional_case(100, *TRUTHS["both"])
    found = chosen(case, ["coulomb_friction"])
    values = laplace.values_at(found.problem, found.whitening.centre)
    rng, scalars = np.random.default_rng(0), {}
    for name, value in values.items():
        if np.ndim(value) == 0:
            scalars[name] = value * (1.0 + 0.01 * rng.standard_normal((2, 50)))
    kept = {"posterior": scalars, "observed_data": {"force": case.records.force}}
    kept |= {"sample_stats": {"diverging": np.zeros((2, 50), bool)}}
    tree = from_dict(kept | {"constant_data": posterior_file.covariates(case.records)})
    settings = {"kind": "dynamic", "with_gap": False, "seed": 0, "seconds": 0.0}
    settings |= {"chains": 2, "warmup": 1, "draws": 50, "versions": {}}
    settings |= {"target_acceptance": 0.8}
    checks = (Check("by hand", "passed", "told to"),)
    about = found.problem.effects, found.priors, tree, {}, checks, settings
    return DynamicPosterior(case, "ring", *about)


@pytest.mark.slow
def test_the_friction_is_sampled():
    case = frictional_case(0, 0.01, 1.0, rows=96)
    found = calibrate_dynamic(case, effects=["coulomb_friction"], **FEW)
    low, high = np.quantile(found.draws[FRICTION], [0.001, 0.999])
    assert low <= 1.0 <= high and high - low < 0.5


def test_the_friction_is_kept_and_taken_along(posterior, tmp_path):
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_any(tmp_path)
    assert [effect.name for effect in loaded.effects] == ["coulomb_friction"]
    assert np.array_equal(loaded.draws[FRICTION], posterior.draws[FRICTION])
    moved = respond(loaded, "step", amplitude=40.0, duration=0.02, points=51, draws=20)
    assert moved.effects == ("coulomb_friction",)


def test_the_share_of_dry_friction_is_told(posterior):
    found = found_loss(posterior)
    assert found.name is None and found.probabilities == {}
    # 4 f A and π c ω A² of 0.2 mm: f = 1 N, ζ = 0.01 at 350 Hz.
    assert found.dry_share is not None
    expected = 4.0 / (4.0 + np.pi * 2 * 0.01 * 195 * 0.2)
    assert found.dry_share.median == pytest.approx(expected, rel=0.1)
    assert "Dry friction was asked for; dry friction takes" in loss_words(found)


def weighed(posterior, shares: dict, noise: str = "passed") -> DynamicPosterior:
    """Return a posterior with probabilities and checks made by hand."""
    settings = {**posterior.settings, "loss": shares}
    checks = (Check(loss.LEFT_OVER, noise, "by hand"),)  # pyright: ignore
    return replace(posterior, settings=settings, checks=checks)


def test_a_linear_model_that_leaves_noise_is_named(posterior):
    for outcome, name in (("passed", "viscous"), ("warning", None)):
        checks = (Check(loss.WHITENESS, outcome, "by hand"),)  # pyright: ignore
        linear = replace(posterior, effects=(), checks=checks)
        found = found_loss(linear)
        assert found.name == name and found.probabilities == {}
        assert ("what that leaves is noise" in loss_words(found)) == bool(name)


@pytest.mark.parametrize("name", TRUTHS)
def test_a_name_needs_nine_tenths_and_residuals_of_noise(name, posterior):
    rest = dict.fromkeys(TRUTHS, 0.04) | {name: 0.92}
    found = found_loss(weighed(posterior, rest))
    assert found.name == name and "probability 92 %" in loss_words(found)
    spoiled = found_loss(weighed(posterior, rest, "warning"))
    assert spoiled.name == "cannot tell"
    torn = weighed(posterior, dict.fromkeys(TRUTHS, 0.1) | {name: 0.8})
    assert found_loss(torn).name == "cannot tell"
    assert "cannot be told" in loss_words(found_loss(torn))
    assert next_steps(torn, found_loss(torn))[0].startswith("To tell viscous")
    middle = dynamic_answer(torn).natural_frequency_Hz
    assert ("friction" in headline(middle, found)) == (name != "viscous")
    assert "friction" not in headline(middle, spoiled)


def test_a_file_with_probabilities_of_other_models_is_refused(posterior, tmp_path):
    weighed(posterior, {"plastic": 1.0}).save(tmp_path / "posterior.nc")
    with pytest.raises(InputError, match="not a posterior"):
        load_any(tmp_path)


def test_a_friction_left_out_is_told_by_the_damping():
    case = frictional_case(0, 0.01, 1.0)
    found = chosen(case, [])
    true = 2.0 * 0.01 * np.sqrt(at_mode(found, "stiffness") * TRUTH["mass"])
    assert at_mode(found, "damping") > 3.0 * true
