"""What takes the energy of a swing is named, or it is said that it cannot be told."""

from dataclasses import replace

import numpy as np
import pytest
from moving import TRUTH, frictional_case, moving_case, moving_gear

from hdcal import InputError, Prior, calibrate_dynamic, respond
from hdcal.inference import laplace
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
from hdcal.report.plain import as_json

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


@pytest.mark.parametrize("name", TRUTHS)
def test_a_loss_is_named(name: str):
    ratio, friction = TRUTHS[name]
    found = chosen(frictional_case(100, ratio, friction))
    assert found.probabilities[name] >= 0.9
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    assert at_mode(found, "damping_ratio") == pytest.approx(ratio, rel=0.1, abs=1e-9)
    if friction:
        assert at_mode(found, FRICTION) == pytest.approx(friction, rel=0.05)
    assert (found.problem.effects == ()) == (name == "viscous")


def test_an_evidence_without_the_priors_breadth_is_told_by_a_wrong_name(monkeypatch):
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
            likeliest = max(shares, key=lambda n: shares[n])
            told += shares[likeliest] >= 0.9
            wrong += shares[likeliest] >= 0.9 and likeliest != name
    assert told >= 36 and wrong <= 1, (told, wrong)


def test_long_records_keep_the_linear_model_and_say_so(monkeypatch):
    monkeypatch.setattr(loss, "MOST_ROWS", 100)
    found = chosen(moving_case(0))
    assert found.problem.effects == () and not found.probabilities
    assert [check.outcome for check in found.checks] == ["note"]
    assert "200, all damping counts as viscous" in found.checks[0].words


def test_without_effects_nothing_is_weighed():
    found = chosen(moving_case(0), [])
    assert found.problem.effects == () and not found.probabilities and not found.checks


def test_an_effect_that_the_model_does_not_hold_is_refused():
    with pytest.raises(InputError, match="does not hold 'hysteresis'"):
        calibrate_dynamic(moving_case(0), effects=["hysteresis", "coulomb_friction"])


def test_a_stated_friction_of_any_family_is_taken():
    gear = moving_gear()
    for prior in (Prior("fixed", (1.0,), "N"), Prior("uniform", (0.5, 3.0), "N")):
        stated = replace(gear, effect_priors={FRICTION: prior})
        case = frictional_case(0, 0.01, 1.0, stated)
        found = chosen(case, ["coulomb_friction"])
        assert at_mode(found, FRICTION) == pytest.approx(1.0, rel=0.05)


@pytest.fixture(scope="module")
def posterior() -> DynamicPosterior:
    """A calibration with friction, of far too few draws for its checks."""
    case = frictional_case(0, 0.01, 1.0, rows=96)
    return calibrate_dynamic(case, effects=["coulomb_friction"], **FEW)


def test_the_friction_is_found_kept_and_taken_along(posterior, tmp_path):
    low, high = np.quantile(posterior.draws[FRICTION], [0.001, 0.999])
    assert low <= 1.0 <= high and high - low < 0.5
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_any(tmp_path)
    assert [effect.name for effect in loaded.effects] == ["coulomb_friction"]
    assert as_json(dynamic_answer(loaded)) == as_json(dynamic_answer(posterior))
    good = replace(loaded, checks=(Check("by hand", "passed", "told to"),))
    moved = respond(good, "step", amplitude=40.0, duration=0.02, points=51, draws=20)
    assert moved.effects == ("coulomb_friction",)


def test_the_share_of_dry_friction_is_told(posterior):
    found = found_loss(posterior)
    assert found.name is None and found.probabilities == {}
    # 4 f A and π c ω A² of 0.2 mm: f = 1 N, ζ = 0.01 at 350 Hz.
    assert found.dry_share is not None
    assert found.dry_share.lo < 4.0 / (4.0 + np.pi * 2 * 0.01 * 195 * 0.2) < 1.0
    assert found.dry_share.hi < 0.8
    assert "Dry friction was asked for; dry friction takes" in loss_words(found)


def weighed(posterior, shares: dict, noise: str = "passed") -> DynamicPosterior:
    """Return a posterior with probabilities and checks made by hand."""
    settings = {**posterior.settings, "loss": shares}
    checks = (Check(loss.WHITENESS, noise, "by hand"),)  # pyright: ignore
    return replace(posterior, settings=settings, checks=checks)


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
    _, stiffness = TRUTH["mass"], at_mode(found, "stiffness")
    true = 2.0 * 0.01 * np.sqrt(stiffness * TRUTH["mass"])
    assert at_mode(found, "damping") > 3.0 * true
