"""The response of a calibrated gear: right for every draw, honest about its priors."""

from inspect import signature

import numpy as np
import pytest
from moving import TRUTH, motion, still_posterior

from hdcal import InputError, NotUsable, respond
from hdcal.data.case import Gear
from hdcal.inference.discrepancy import BASIS_SIZE
from hdcal.motion.respond import integrate
from hdcal.motion.respond import respond as asked
from hdcal.physics import dynamics
from hdcal.physics.linear_response import LinearGear, linear_response
from hdcal.prediction.engine.gear_forces import gear_forces, gear_values
from hdcal.prediction.engine.pooled import pool
from hdcal.prediction.engine.untested import PLACES

# One number of points and draws for all: the integration is compiled once.
SMALL = {"points": 101, "draws": 50, "duration": 0.02}
KNOWN = {"mass": TRUTH["mass"], "damping": 3e-3}


def test_gears_that_are_known_move_as_the_exact_solution():
    posterior = still_posterior()
    found = respond(posterior, "step", amplitude=40.0, **KNOWN, **SMALL)
    stiffness = motion(TRUTH, posterior.case).stiffness
    force = np.full(101, 40.0)
    linear = LinearGear(KNOWN["mass"], KNOWN["damping"], stiffness)
    exact = linear_response(linear, found.time_s, force, np.zeros(2))[:, 0]
    assert found.deformation_median_mm == pytest.approx(np.asarray(exact), abs=1e-7)
    assert found.deformation_hi_mm - found.deformation_lo_mm == pytest.approx(
        np.zeros(101), abs=1e-9
    )
    finely = np.linspace(0.0, found.time_s[-1], 20_001)
    moved = linear_response(linear, finely, np.full(20_001, 40.0), np.zeros(2))[:, 0]
    peak = found.estimates["peak_mm"]["median"]
    assert peak == pytest.approx(float(moved.max()), rel=2e-4)
    drivers = {name: entry["driven_by"] for name, entry in found.estimates.items()}
    assert drivers["mass_kg"] == drivers["damping_N_s_per_mm"] == "given"
    assert drivers["natural_frequency_Hz"] == "data"
    assert not any("prior" in words for words in found.remarks)


@pytest.mark.thorough
def test_draws_integrated_by_the_few_move_alike(monkeypatch):
    given = (still_posterior(K=0.05), "step")
    together = respond(*given, **KNOWN, **SMALL)
    monkeypatch.setattr(integrate, "_MOST_STATES", 20 * SMALL["points"])
    monkeypatch.setattr(asked, "_TIMES", 40)
    apart = respond(*given, **KNOWN, **SMALL)
    for name, column in together.columns().items():
        np.testing.assert_allclose(apart.columns()[name], column, atol=1e-10)
    for name, one in together.estimates.items():
        assert apart.estimates[name]["hi"] == pytest.approx(one["hi"])


def test_without_them_priors_are_the_answer_and_it_says_so():
    found = respond(still_posterior(), "step", amplitude=40.0, **SMALL)
    drivers = {name: entry["driven_by"] for name, entry in found.estimates.items()}
    assert drivers.pop("stiffness_N_per_mm") == "data"
    assert set(drivers.values()) == {"prior"}
    frequency = found.estimates["natural_frequency_Hz"]
    # A mass known to a factor of two either way (sd) leaves √2 of the frequency.
    assert np.log(frequency["hi"] / frequency["lo"]) == pytest.approx(
        0.7 * 1.96, rel=0.3
    )
    assert found.deformation_hi_mm[-1] - found.deformation_lo_mm[-1] > 0.1


def test_the_band_is_as_wide_as_the_stiffness_is_uncertain():
    posterior = still_posterior(K=0.05)
    slow = ([0.0, 0.019, 0.02], [0.0, 40.0, 40.0])
    options = {name: value for name, value in SMALL.items() if name != "duration"}
    found = respond(posterior, slow, **KNOWN, **options)
    width = found.deformation_hi_mm[-1] / found.deformation_lo_mm[-1]
    stiffness = found.estimates["stiffness_N_per_mm"]
    assert np.log(stiffness["hi"] / stiffness["lo"]) == pytest.approx(0.2, rel=0.35)
    assert np.log(width) == pytest.approx(
        np.log(stiffness["hi"] / stiffness["lo"]), rel=0.25
    )


def test_a_warmer_gear_is_softer():
    cold = respond(still_posterior(), "step", **KNOWN, **SMALL)
    warm = respond(still_posterior(), "step", temperature=120.0, **KNOWN, **SMALL)
    parts = [r.estimates["stiffness_N_per_mm"]["median"] for r in (cold, warm)]
    assert parts[1] / parts[0] == pytest.approx(1.0 - 3e-4 * 100.0, rel=1e-9)
    assert cold.tested.any() and not warm.tested.any()
    assert any("extrapolated" in words for words in warm.remarks)


@pytest.mark.thorough
def test_effects_of_the_moment_go_along_and_others_are_named():
    sizes = {"progressive_stiffening.slope": 0.8, "relaxation.share": 0.1}
    sizes |= {"relaxation.time_constant": 30.0}
    found = respond(still_posterior(sizes), "step", **KNOWN, **SMALL)
    linear = respond(still_posterior(), "step", **KNOWN, **SMALL)
    assert found.effects == ("progressive_stiffening",)
    assert found.left_out == ("relaxation",)
    assert any("relaxation" in words for words in found.remarks)
    peaks = [r.estimates["peak_mm"]["median"] for r in (found, linear)]
    assert peaks[0] < 0.9 * peaks[1]


@pytest.mark.thorough
def test_a_leftover_that_was_fitted_bends_the_motion():
    weights = np.zeros(BASIS_SIZE)
    weights[[1, 2]] = 6.0, -4.0
    posterior = still_posterior(gap=weights)
    # Held until the swing has died out.
    slow = ([0.0, 0.01, 0.04], [0.0, 60.0, 60.0])
    options = {name: value for name, value in SMALL.items() if name != "duration"}
    given = KNOWN | {"damping": 5e-2}
    bent, straight = (
        respond(one, slow, **given, **options).deformation_median_mm[-1]
        for one in (posterior, still_posterior())
    )
    places = np.linspace(0.0, 0.5, 201)
    values, untested = gear_values(pool(posterior))
    where = places, np.full(201, 20.0), 1.0, untested
    forces = np.asarray(gear_forces(posterior.problem, values, *where))[:, 0]
    at_rest = np.interp(60.0, forces - forces[0], places)
    assert abs(at_rest - straight) > 0.02
    assert bent == pytest.approx(at_rest, abs=1e-3)


def test_beyond_what_was_tested_the_band_is_wider_and_inside_it_is_not():
    near, far = (
        respond(still_posterior(), "step", amplitude=force, **KNOWN, **SMALL)
        for force in (40.0, 80.0)
    )
    assert near.tested.all() and not far.tested.all()
    width = far.deformation_hi_mm - far.deformation_lo_mm
    first = int(np.argmin(far.tested))
    assert width[: first // 2].max() < 1e-9
    assert width.max() > 1e-3


def test_draws_that_are_kept_fill_what_is_open_evenly():
    posterior = still_posterior()
    for most in (50, 100, 128):
        values, _ = gear_values(pool(posterior), 0, most)
        assert len(values["K"]) == most
        for score in values[PLACES].T:
            assert 0.4 <= np.mean(score > 0.0) <= 0.6


@pytest.mark.thorough
def test_the_peak_is_that_of_the_motion_and_not_of_the_points():
    asked = KNOWN | {"damping": 1e-3, "duration": 0.02, "draws": 20}
    few, many = (
        respond(still_posterior(), "step", amplitude=40.0, points=points, **asked)
        for points in (45, 4001)
    )
    exact = many.estimates["peak_mm"]["median"]
    assert few.estimates["peak_mm"]["median"] == pytest.approx(exact, rel=1e-3)
    assert few.deformation_median_mm.max() < 0.998 * exact
    assert any("more points" in words for words in few.remarks)


def test_what_swings_faster_than_the_points_is_told():
    found = respond(still_posterior(), "step", **KNOWN, **{**SMALL, "duration": 0.5})
    assert any("more points" in words for words in found.remarks)


def test_nothing_follows_from_a_failed_calibration():
    with pytest.raises(NotUsable, match="by hand"):
        respond(still_posterior(usable=False), "step", **KNOWN, **SMALL)


@pytest.mark.parametrize(
    ("force", "options", "words"),
    [
        ("push", {}, "no known force"),
        ("step", {"amplitude": 0.0}, "drives nothing"),
        ("step", {"amplitude": np.nan}, "nan N does not lie"),
        ("step", {"amplitude": 1e6}, "even at rest"),
        ("step", {"duration": 0.0}, "0 s does not lie"),
        ("step", {"duration": 5e3}, "swings of the gear"),
        ("step", {"frequency": 5.0}, "no frequency"),
        ("sine", {}, "needs one frequency"),
        ("sine", {"frequency": 0.0}, "not positive"),
        ("sine", {"frequency": -5.0}, "-5 Hz does not lie"),
        ("sine", {"frequency": 1001.0, "duration": 0.5}, "cannot be seen"),
        ("chirp", {"frequency": 5.0}, "first and last"),
        ("chirp", {"frequency": (5.0, 5.0)}, "is a sine"),
        ("chirp", {"frequency": (0.0, 2e4)}, "cannot be seen"),
        ("step", {"mass": -1e-5}, "does not lie"),
        ("step", {"damping": -1.0}, "does not lie between 0"),
        ("step", {"points": 1}, "1 does not lie between 2"),
        ("step", {"draws": 1}, "1 does not lie between 20"),
        ("step", {"temperature": -300.0}, "absolute zero"),
        ("step", {"temperature": 2500.0}, "half of Young's modulus"),
        (([0.0, 1.0], [0.0, 0.0]), {}, "zero throughout"),
        (([0.0, 0.0], [0.0, 1.0]), {}, "do not rise"),
        (([0.0], [1.0]), {}, "two or more"),
        (([0.0, 1.0], [0.0, np.inf]), {}, "holds inf N"),
        (([0.0, 1.0], [0.0, 1.0]), {"duration": 1.0}, "has its own"),
    ],
)
def test_what_makes_no_sense_is_refused(force, options, words):
    with pytest.raises(InputError, match=words) as caught:
        respond(still_posterior(), force, **options)
    assert {f.file for f in caught.value.findings} <= {*signature(respond).parameters}


def test_every_fault_is_told_at_once():
    with pytest.raises(InputError) as caught:
        respond(still_posterior(), "sine", duration=-1.0, mass=-1.0, points=0)
    assert len(caught.value.findings) == 4


def test_gears_that_run_away_are_told_at_once(monkeypatch):
    """Beyond what was tested a draw may give way: to follow it took minutes."""
    posterior = still_posterior()
    stiffness = motion(TRUTH, posterior.case).stiffness
    reach = 1.2 * 40.0 / stiffness
    monkeypatch.setattr(Gear, "reach", property(lambda _: reach))
    with pytest.raises(NotUsable, match=r"50 of 50 gears give way .* pulled as well"):
        respond(posterior, "step", amplitude=40.0, **KNOWN, **SMALL)


@pytest.mark.thorough
def test_a_motion_of_too_many_steps_is_told(monkeypatch):
    monkeypatch.setattr(dynamics, "MOST_STEPS", 3)
    asked_for = {**SMALL, "points": 102}
    with pytest.raises(NotUsable, match="50 of 50 motions could not be integrated"):
        respond(still_posterior(), "step", amplitude=40.0, **KNOWN, **asked_for)
