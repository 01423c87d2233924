"""A leftover knows loading from unloading, where both were tested."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import cycles, make_case

import hdcal
from hdcal.calibration.charts import distance_from_model
from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.bands import default_bands
from hdcal.tracking.tracker import Tracker

STIFFNESS, OPENING, NOISE = 195.0, 0.06, 0.3
WAYS = (1.0, -1.0)
PLACES = np.array([0.1, 0.2, 0.3, 0.4, 0.5])


def truth(deformation, sense):
    """Return the force of a loop that opens with the load, in no effect's form."""
    shape = np.asarray(deformation) / 0.54
    return STIFFNESS * deformation * (1.0 + OPENING * sense * shape**0.5)


@cache
def looped(*, told: bool = True) -> Posterior:
    """Return the calibration with a leftover of a rig that draws such loops.

    Where the loop is not `told` the data do not say that the gear was unloaded.
    """
    records = replace(cycles(96), temperature=np.full(96, 20.0))
    known = {"unloading"} if told else set()
    force = truth(records.deformation, records.sense)
    force = force + np.random.default_rng(4).normal(0.0, NOISE, 96)
    case = make_case(replace(records, force=force, known=frozenset(known)))
    # One in ten such loops leaves what passes for noise that grows; so few draws do not
    # always settle how much.
    return hdcal.calibrate(
        case,
        with_gap=True,
        adapt_noise=False,
        warmup=400,
        draws=800,
        chains=2,
        seed=1,
    )


def bands(posterior, direction):
    """Return ends of the 95 % band of the mean with the leftover, (2, place) [N]."""
    found = hdcal.predict(posterior, PLACES, [20.0], direction, allow_failed=True)
    return found.with_gap_lo_N, found.with_gap_hi_N


def test_bands_of_each_direction_have_their_own_leftover():
    """Draws are made by hand: what the directions differ by is known."""
    case = ramp_case(known={"unloading"}, sense=np.tile([1.0, -1.0], 15))
    draws = plain_draws(case, 200)
    draws |= {"gap_sd": np.full(200, 1.5), "gap_length": np.full(200, 0.3)}
    gap = written_posterior(case, draws, with_gap=True).problem.discrepancy
    up, down = (np.asarray(gap.columns(PLACES, sense + 0.0 * PLACES)) for sense in WAYS)
    weights = np.ones(up.shape[1]) / (1.0 + np.arange(up.shape[1]))
    draws["gap_weights"] = np.tile(weights, (200, 1))
    known = written_posterior(case, draws, with_gap=True)
    median = [
        hdcal.predict(known, PLACES, [20.0], way).with_gap_median_N
        for way in ("up", "down")
    ]
    expected = (up - down) @ weights
    assert np.max(np.abs(expected)) > 0.1
    np.testing.assert_allclose(median[0] - median[1], expected, atol=1e-6)


@pytest.mark.thorough
def test_the_mean_of_each_direction_lies_in_its_own_band():
    for direction, sense in (("up", 1.0), ("down", -1.0)):
        low, high = bands(looped(), direction)
        true = truth(PLACES, sense)
        assert np.all((low < true) & (true < high))
        # The loop is a multiple of what is left open.
        assert np.all(high - low < 0.4 * np.abs(true - truth(PLACES, -sense)) + 0.5)


@pytest.mark.thorough
def test_without_it_both_means_lie_outside():
    held = [
        (low < truth(PLACES, sense)) & (truth(PLACES, sense) < high)
        for sense, (low, high) in (
            (1.0, bands(looped(told=False), "up")),
            (-1.0, bands(looped(told=False), "down")),
        )
    ]
    assert np.mean(held) < 0.5


@pytest.mark.thorough
def test_a_margin_of_unloading_is_below_that_of_loading():
    (up,), (down,) = (
        hdcal.margin(looped(), 0.5, direction=way).levels for way in ("up", "down")
    )
    assert up.force_N.lo > down.force_N.hi


@pytest.mark.thorough
def test_beside_friction_the_leftover_has_no_loop():
    """Else the friction of a rig that has nothing but friction would be anything."""
    records = replace(cycles(96), temperature=np.full(96, 20.0))
    force = STIFFNESS * records.deformation + 3.0 * records.sense
    force = force + np.random.default_rng(5).normal(0.0, NOISE, 96)
    case = make_case(replace(records, force=force))
    size = {"warmup": 400, "draws": 400, "chains": 2, "seed": 1}
    found = hdcal.calibrate(case, effects=["coulomb_friction"], with_gap=True, **size)
    size = found.draws["coulomb_friction.force"]
    assert np.std(size) < 0.1
    assert np.mean(size) == pytest.approx(3.0, abs=4.0 * NOISE / np.sqrt(96))


@pytest.mark.thorough
def test_readings_lie_about_the_bands_of_their_own_direction():
    """In the figure: what the leftover adds to the physics goes with the direction."""
    found = looped()
    shown = default_bands(found)
    left = hdcal.residuals(found)
    away = distance_from_model(shown, left)
    rising = left.direction > 0.0
    middle = shown.physics_median_N[np.asarray(shown.direction) == "up"]
    place = shown.deformation_mm[np.asarray(shown.direction) == "up"]
    expected = left.measured - np.interp(left.deformation, place, middle)
    for way in (rising, ~rising):
        np.testing.assert_allclose(away[way], expected[way], atol=0.6)


@pytest.mark.thorough
def test_a_stream_counts_half_the_loop_as_noise():
    """It does not say which way it moves: of 600 readings 95 % and more lie inside."""
    rng = np.random.default_rng(3)
    tracker, inside = Tracker(looped()), []
    for row in range(600):
        at, sense = float(rng.uniform(0.1, 0.5)), 1.0 if row // 40 % 2 else -1.0
        force = float(truth(at, sense) + rng.normal(0.0, NOISE))
        low, high = tracker.update(at, force)["force_N"]["predictive_95"]
        inside.append(low < force < high)
    assert np.mean(inside) > 0.93
