"""Direction, rate and features of the loading survive reading noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdcal.data.loading import derive_motion, loading, movement_words
from hdcal.screening.turning_points import resting, turning_points

# A way that takes longer at one time than at another: by resting or by speed.
EITHER = "holds or rates"


def motion(deformation, time=None, run=None):
    x = np.asarray(deformation, float)
    run = np.zeros(x.size, int) if run is None else np.asarray(run)
    return derive_motion(x, run, None if time is None else np.asarray(time, float))


def slow_turning_points(x, threshold):
    """The definition, row by row."""
    found, sign, first, best, low, high = [], 0, 0, 0, 0, 0
    for row in range(len(x)):
        if sign == 0:
            low = row if x[row] < x[low] else low
            high = row if x[row] > x[high] else high
            if x[high] - x[low] >= threshold:
                sign = first = 1 if high > low else -1
                best = row
        elif sign * (x[row] - x[best]) > 0:
            best = row
        elif sign * (x[best] - x[row]) >= threshold:
            found.append(best)
            sign, best = -sign, row
    return found, first


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.integers(-20, 20), min_size=1, max_size=60),
    st.sampled_from([0.5, 1.0, 3.0, 10.0]),
)
def test_turning_points_as_by_definition(values, threshold):
    x = np.array(values, float)
    rows, first = turning_points(x, threshold)
    assert (rows.tolist(), first) == slow_turning_points(x, threshold)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=60), st.sampled_from([0.5, 3]))
def test_resting_as_by_definition(steps, tolerance):
    level = np.cumsum(np.array(steps, float))
    for row, rests in enumerate(resting(level, tolerance)):
        near = np.count_nonzero(np.abs(level - level[row]) <= tolerance / 2)
        wide = np.count_nonzero(np.abs(level - level[row]) <= 2 * tolerance)
        assert rests == (near >= 2 and wide < 1.5 * near)


def test_load_hold_unload():
    found = motion([0, 1, 2, 2, 2, 1, 0, 0, 0, 1, 2], time=np.arange(11) * 2)
    assert found.direction.tolist() == [1, 1, 1, 0, 0, -1, -1, 0, 0, 1, 1]
    assert found.sense.tolist() == [1, 1, 1, 1, 1, -1, -1, -1, -1, 1, 1]
    assert found.rate.tolist() == [0.5, 0.5, 0.5, 0, 0, -0.5, -0.5, 0, 0, 0.5, 0.5]
    assert found.features == {"unloading", "holds", EITHER}


SHAPES = {
    "ramp": (lambda u: u, 0, set()),
    "triangle": (lambda u: 1 - np.abs((8 * u) % 2 - 1), 7, {"unloading", "cycles"}),
    "sine": (
        lambda u: np.sin(8 * np.pi * u),
        8,
        {"unloading", "cycles", "rates", EITHER},
    ),
    "one cycle with holds": (
        lambda u: np.interp(u, [0, 0.2, 0.5, 0.7, 1], [0, 1, 1, 0, 0]),
        1,
        {"unloading", "holds", EITHER},
    ),
    "two speeds": (
        lambda u: np.interp(u, [0, 0.4, 0.8, 0.9, 1], [0, 1, 0, 1, 0]),
        3,
        {"unloading", "cycles", "rates", EITHER},
    ),
}


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("rows", [400, 20_000])
@pytest.mark.parametrize("shape", SHAPES)
def test_features_through_noise(shape, rows, noise):
    curve, reversals, features = SHAPES[shape]
    u = np.arange(rows) / rows
    rng = np.random.default_rng(7)
    found = motion(curve(u) + noise * rng.normal(size=rows), time=u * 60)
    assert np.count_nonzero(np.diff(found.sense)) == reversals
    assert found.features == features
    slope = np.sign(np.diff(curve(u)))
    agree = found.direction[1:] == slope
    assert agree.mean() > 0.9


@pytest.mark.parametrize(
    ("deformation", "movement", "words"),
    [
        ([0.02, 0.2, 0.4, 0.2], [1, 1, 1, -1], "loading"),
        ([-0.02, -0.2, -0.4, -0.2], [-1, -1, -1, 1], "unloading"),
        # a zero that is a little off makes no test in tension
        ([-0.01, 0.2, 0.4, 0.2], [1, 1, 1, -1], "loading"),
        ([0.2, 0.3, -0.3, -0.2], [1, 1, -1, 1], "increasing deformation"),
    ],
)
def test_loading_is_away_from_the_undeformed_gear(deformation, movement, words):
    x = np.array(deformation)
    assert loading(x, np.array(movement)).tolist() == [1, 1, 1, -1]
    assert movement_words(x)[1] == words


RAMP = np.linspace(0.02, 0.38, 10)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_new_ramp_is_no_unloading(sense):
    found = motion(sense * np.tile(RAMP, 3))
    assert found.resets == (10, 20)
    assert found.features == {"cycles"}


@pytest.mark.parametrize(
    "deformation",
    [
        [*RAMP, *RAMP[::-1], *RAMP[1:]],
        # as coarse on the way up as on the way down
        [0.0, 0.4, 0.0, 0.4, 0.0, 0.4],
        # one step back over less than half of the range
        [*RAMP, *RAMP[6:]],
    ],
)
def test_what_was_read_on_the_way_back_is_unloading(deformation):
    found = motion(deformation)
    assert found.resets == ()
    assert "unloading" in found.features


def test_runs_are_separate():
    found = motion([0, 5, 1, 4, 2, 3], run=[0, 1, 0, 1, 0, 1])
    assert found.direction.tolist() == [1, -1, 1, -1, 1, -1]
    assert found.features == {"unloading"}


def test_the_rate_through_noise():
    rows = 20_000
    u = np.arange(rows) / rows
    noisy = 0.5 * u + 1e-4 * np.random.default_rng(0).normal(size=rows)
    found = motion(noisy, time=100 * u)
    assert np.median(found.rate) == pytest.approx(0.005, rel=0.02)
    assert np.quantile(np.abs(found.rate / 0.005 - 1), 0.95) < 0.2
