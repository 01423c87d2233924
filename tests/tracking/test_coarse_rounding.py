"""Readings that are coarsely rounded: the stiffness is not known better than it is."""

import copy

import numpy as np
import pytest
from rigs import make_gear

from hdcal.data.priors import Prior
from hdcal.tracking.coarse_rounding import CoarseRounding
from hdcal.tracking.stream_prior import prior_from_gear
from hdcal.tracking.tracker import Tracker

STEP = 0.98


def coverage(
    noise: float, streams: int, rows: int, forget: float = 1.0
) -> tuple[float, float]:
    """Return how often reading and stiffness lie inside, five deformations in turn."""
    priors = {
        "K": Prior("lognormal", (2.6, 0.02)),
        "force_offset": Prior("normal", (0.0, 2.0)),
        "sigma": Prior("lognormal", (noise, 0.15)),
    }
    gear = make_gear(resolution=STEP, **priors)
    begin, start = prior_from_gear(gear, seed=9), Tracker(gear, forget=forget)
    deformation = np.resize(np.linspace(0.05, 0.5, 5), rows)
    reading, stiffness = [], []
    for i in range(streams):
        truth, rng = begin.coefficients()[i], np.random.default_rng(500 + i)
        sd = np.sqrt(begin.variance[i] - STEP**2 / 12.0)
        force = truth[0] * deformation + truth[2] + rng.normal(0.0, sd, rows)
        mine, found = copy.deepcopy(start), {}
        rounded = STEP * np.round(force / STEP)
        for columns in zip(deformation.tolist(), rounded.tolist(), strict=True):
            found = mine.update(*columns)
            low, high = found["force_N"]["predictive_95"]
            reading.append(low <= columns[1] <= high)
        low, high = found["stiffness_N_per_mm"]["credible_95"]
        stiffness.append(low < truth[0] < high)
    return float(np.mean(reading)), float(np.mean(stiffness))


def test_intervals_hold_where_every_force_is_read_many_times():
    reading, stiffness = coverage(0.05, 25, 300)
    assert reading > 0.93
    # Chance of fewer than 20 of 25 at 95 %: 0.1 %.
    assert stiffness >= 0.8


def test_readings_taken_as_new_each_time_are_flagged(monkeypatch):
    monkeypatch.setattr(CoarseRounding, "share", lambda *_: 0.0)
    assert coverage(0.05, 12, 300)[1] < 0.7


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.05, 0.3, 0.8])
def test_intervals_hold_at_every_noise(noise):
    reading, stiffness = coverage(noise, 100, 1000)
    assert reading > 0.93
    # Errors of rounding at even spacing have longer tails than a normal law.
    assert stiffness > (0.8 if noise < 0.1 else 0.88)


def test_intervals_hold_and_stay_where_the_past_is_forgotten():
    reading, stiffness = coverage(0.05, 25, 300, forget=0.99)
    assert reading > 0.93
    assert stiffness >= 0.8


def test_a_gear_that_softens_is_followed_where_the_past_is_forgotten():
    gear, width = make_gear(resolution=1.0), {}
    tracker, rng = Tracker(gear, forget=0.99), np.random.default_rng(0)
    deformation = np.resize([0.1, 0.2, 0.3, 0.4, 0.5], 1500).tolist()
    for row, at in enumerate(deformation):
        stiffness = 209.0 if row < 1000 else 180.0
        force = np.round(stiffness * at + 2.3 + rng.normal(0.0, 0.1))
        low, high = tracker.update(at, float(force))["stiffness_N_per_mm"][
            "credible_95"
        ]
        width[row] = high - low
        if row in (100, 999):
            assert low < 209.5 and high > 208.5
    # Repeated readings say nothing new, and what fades they say again.
    assert width[999] < 2.0 * width[100]
    assert low < 180.5 and high > 179.5
    assert tracker.alarms < 20


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_what_is_kept_of_a_force_is_what_its_faded_number_says(share):
    rounding, forget, kept, count = CoarseRounding(STEP, 0.9), 0.9, 0.0, 0.0
    for row in range(60):
        if row % 3:
            rounding.weight(100.0, 0.0)
            kept, count = forget * kept, forget * count
            continue
        count = forget * count + 1.0
        kept = forget * kept + rounding.weight(12.0, share)
        if share == 0.9:
            assert kept == pytest.approx(count / (count * share + 1.0 - share))


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_repeated_readings_add_up_to_what_their_mean_says(share):
    rounding, count = CoarseRounding(STEP), 7
    said = sum(rounding.weight(12.0, share) for _ in range(count))
    # Variance of the mean: what repeats, and a share of the rest.
    assert said == pytest.approx(1.0 / (share + (1.0 - share) / count))
    assert rounding.weight(13.0, share) == 1.0


def test_the_repeated_share_is_that_of_simulated_readings():
    rng, place = np.random.default_rng(0), np.linspace(0.0, STEP, 200, endpoint=False)
    for noise in (0.01, 0.2, 0.3):
        force = place[:, None] + noise * rng.standard_normal((200, 4000))
        error = STEP * np.round(force / STEP) - place[:, None]
        expected = np.var(error.mean(axis=1)) / np.var(error)
        found = CoarseRounding(STEP).share(noise**2 + STEP**2 / 12.0)
        assert found == pytest.approx(expected, abs=0.1)


def test_fine_steps_change_nothing():
    assert CoarseRounding(0.0).share(1.0) == 0.0
    assert CoarseRounding(0.1).share(0.25 + 0.01 / 12.0) == 0.0
    assert CoarseRounding(0.1).weight(1.0, 0.0) == 1.0
