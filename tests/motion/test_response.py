"""The response of a calibrated gear: that of the closed form, and of its priors."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from matplotlib.figure import Figure
from mirrored import mirrored_case
from moving import TRUTH, motion, still_posterior
from schema_checks import obeys

from hdcal import InputError, NotUsable, respond
from hdcal.data.case import Gear
from hdcal.inference.force_model.discrepancy import BASIS_SIZE
from hdcal.motion import gears_in_motion
from hdcal.motion.response import Response
from hdcal.physics.linear_response import LinearGear, linear_response

# One number of points and draws for all: the integration is compiled once.
SMALL = {"points": 101, "draws": 50}
BRIEF = SMALL | {"duration": 0.02}
KNOWN = {"mass": TRUTH["mass"], "damping": 3e-3}


def test_gears_that_are_known_move_as_the_exact_solution():
    posterior = still_posterior()
    found = respond(posterior, "step", amplitude=40.0, **KNOWN, **BRIEF)
    table, stiffness = found.to_frame(), motion(TRUTH, posterior.case).stiffness
    linear = LinearGear(KNOWN["mass"], KNOWN["damping"], stiffness)
    time, force = table.time_s.to_numpy(), np.full(101, 40.0)
    exact = np.asarray(linear_response(linear, time, force, np.zeros(2)))[:, 0]
    for end in ("lo", "median", "hi"):
        # Exact readings leave a bend of some 1e-5 of the force possible.
        bend = 2e-5 * float(exact.max())
        np.testing.assert_allclose(table[f"deformation_{end}_mm"], exact, atol=bend)
    finely, held = np.linspace(0.0, time[-1], 20_001), np.full(20_001, 40.0)
    moved = linear_response(linear, finely, held, np.zeros(2))[:, 0]
    assert found.estimates.peak_mm.median == pytest.approx(float(moved.max()), rel=3e-4)
    drivers = {name: one.driven_by for name, one in found.estimates}
    assert drivers["mass_kg"] == drivers["damping_N_s_per_mm"] == "given"
    assert drivers["natural_frequency_Hz"] == drivers["peak_mm"] == "data"
    obeys(found.to_dict(), Response)
    axes = found.plot(Figure().add_subplot())
    assert axes.get_ylabel() == "deformation [mm]" and axes.has_data()


def test_without_them_the_priors_are_the_answer():
    found = respond(still_posterior(), "step", amplitude=40.0, **BRIEF)
    drivers = {name: one.driven_by for name, one in found.estimates}
    assert drivers.pop("stiffness_N_per_mm") == "data"
    assert set(drivers.values()) == {"prior"}
    frequency = found.estimates.natural_frequency_Hz
    # A mass known to a factor of two either way (sd) leaves √2 of the frequency.
    ratio = np.log(frequency.hi / frequency.lo)
    assert ratio == pytest.approx(0.7 * 1.96, rel=0.3)
    assert np.ptp(found.motion.iloc[-1][["deformation_lo_mm", "deformation_hi_mm"]]) > 0


def test_the_band_is_as_wide_as_the_stiffness_is_uncertain(monkeypatch):
    """Also where the draws are integrated in several parts."""
    monkeypatch.setattr(gears_in_motion, "_MOST_STATES", 20 * SMALL["points"])
    slow = ([0.0, 0.019, 0.02], [0.0, 40.0, 40.0])
    found = respond(still_posterior(K=0.05), slow, **KNOWN, **SMALL)
    last, stiffness = found.motion.iloc[-1], found.estimates.stiffness_N_per_mm
    width = np.log(stiffness.hi / stiffness.lo)
    assert width == pytest.approx(0.2, rel=0.35)
    band = np.log(last.deformation_hi_mm / last.deformation_lo_mm)
    assert band == pytest.approx(width, rel=0.25)


def test_a_warmer_gear_is_softer():
    cold = respond(still_posterior(), "step", **KNOWN, **BRIEF)
    warm = respond(still_posterior(), "step", temperature=120.0, **KNOWN, **BRIEF)
    parts = [one.estimates.stiffness_N_per_mm.median for one in (cold, warm)]
    assert parts[1] / parts[0] == pytest.approx(1.0 - 3e-4 * 100.0, rel=1e-9)
    assert cold.tested_share > 0.0 and warm.tested_share == 0.0


@pytest.mark.thorough
def test_effects_of_the_moment_act_and_others_are_left_out():
    sizes = {"progressive_stiffening.slope": 0.8, "relaxation.share": 0.1}
    sizes |= {"relaxation.time_constant": 30.0}
    bent = respond(still_posterior(sizes), "step", **KNOWN, **BRIEF)
    linear = respond(still_posterior(), "step", **KNOWN, **BRIEF)
    assert bent.effects == ("progressive_stiffening",)
    assert bent.left_out == ("relaxation",)
    assert bent.estimates.peak_mm.median < 0.9 * linear.estimates.peak_mm.median


@pytest.mark.thorough
def test_a_fitted_discrepancy_bends_the_motion_as_it_bends_the_force():
    from hdcal.prediction.conditions import Conditions
    from hdcal.prediction.joint import joint
    from hdcal.prediction.simulate import gear_forces

    weights = np.zeros(BASIS_SIZE)
    weights[[1, 2]] = 6.0, -4.0
    # Held until the swing has died out.
    slow = ([0.0, 0.01, 0.04], [0.0, 60.0, 60.0])
    given = KNOWN | {"damping": 5e-2}
    posterior = still_posterior(gap=weights)
    bent, straight = (
        respond(one, slow, **given, **SMALL).motion.deformation_median_mm.iloc[-1]
        for one in (posterior, still_posterior())
    )
    places = np.linspace(0.0, 0.5, 201)
    at = Conditions.of(places, 20.0, quantity="gear")
    forces = gear_forces(joint(posterior), at)[0]
    at_rest = np.interp(60.0, forces - forces[0], places)
    assert abs(at_rest - straight) > 0.02
    assert bent == pytest.approx(at_rest, abs=1e-3)


def test_the_band_widens_beyond_what_was_tested():
    near, far = (
        respond(still_posterior(), "step", amplitude=force, **KNOWN, **BRIEF).motion
        for force in (40.0, 80.0)
    )
    assert near.tested.all() and not far.tested.all()
    width = far.deformation_hi_mm - far.deformation_lo_mm
    assert width[: int(np.argmin(far.tested)) // 2].max() < 1e-5 < 1e-3 < width.max()


EFFECTS = {
    "progressive_stiffening.slope": 0.4,
    "coulomb_friction.force": 2.0,
    "seating_slack.clearance": 0.01,
}


def test_a_gear_in_tension_moves_as_the_mirror_image():
    answers = []
    for sense in (1, -1):
        posterior = still_posterior(EFFECTS, K=0.05)
        if sense < 0:
            posterior = replace(posterior, case=mirrored_case(posterior.case))
        found = respond(posterior, "step", amplitude=sense * 80.0, **KNOWN, **BRIEF)
        answers.append(found)
    pressed, pulled = (one.motion for one in answers)
    for one, other in (
        ("force_N", "force_N"),
        ("deformation_lo_mm", "deformation_hi_mm"),
        ("deformation_median_mm", "deformation_median_mm"),
    ):
        # With friction the integration allows an error of 1e-6 per step.
        np.testing.assert_allclose(pulled[one], -pressed[other], rtol=2e-5, atol=1e-8)
    assert np.array_equal(pressed.tested, pulled.tested) and pressed.tested[0]
    for name, one in answers[0].estimates:
        other = getattr(answers[1].estimates, name)
        assert other.driven_by == one.driven_by
        assert other.median == pytest.approx(one.median, rel=2e-5)


@pytest.mark.parametrize(
    ("force", "options", "words"),
    [
        ("push", {}, "not a known force"),
        ("step", {"amplitude": 0.0}, "is 0"),
        ("step", {"amplitude": np.nan}, "nan N does not lie"),
        ("step", {"amplitude": 1e6}, "even statically"),
        ("step", {"amplitude": -1e6}, "even statically"),
        ("step", {"duration": 5e3}, "periods of the vibration"),
        ("step", {"damping": -1.0}, "does not lie between 0"),
        ("step", {"temperature": 2500.0}, "Young's modulus would change by half"),
        (([0.0, 1.0], [0.0, 0.0]), {}, "zero throughout"),
        (([0.0, 1.0], [0.0, np.inf]), {}, "contains inf N"),
        (([1.0, 0.0], [0.0, 1.0]), {}, "do not increase"),
        (([0.0, 1.0], [0.0, 1.0]), {"duration": 1.0}, "for a step only"),
    ],
)
def test_an_impossible_request_is_refused(force, options, words):
    with pytest.raises(InputError, match=words) as caught:
        respond(still_posterior(), force, **options)
    assert {f.file for f in caught.value.findings} <= {*signature(respond).parameters}


def test_gears_that_run_away_give_no_answer(monkeypatch):
    posterior = still_posterior()
    reach = 1.2 * 40.0 / motion(TRUTH, posterior.case).stiffness
    monkeypatch.setattr(Gear, "reach", property(lambda _: reach))
    with pytest.raises(NotUsable, match="50 of 50 draws exceeds"):
        respond(posterior, "step", amplitude=40.0, **KNOWN, **BRIEF)
