"""Noise that errs alike for long is allowed for where a rig is read often."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdcal.diagnosis.detection import correlation_between
from hdcal.evidence.linear_rows import CORRELATIONS
from hdcal.evidence.prepare import _correlations


def read(points: int):
    """Return six loops of so many readings each way."""
    sense = np.tile(np.repeat([1.0, -1.0], points), 6)
    return SimpleNamespace(sense=sense, run=np.zeros(len(sense), int))


@pytest.mark.parametrize("points", [4, 13, 15])
def test_few_readings_leave_short_noise_only(points: int):
    np.testing.assert_array_equal(_correlations(read(points)), CORRELATIONS)


@pytest.mark.parametrize("points", [20, 60, 160, 2000])
def test_noise_may_last_for_a_fifth_of_a_half_cycle(points: int):
    found = _correlations(read(points))
    np.testing.assert_array_equal(found[: len(CORRELATIONS)], CORRELATIONS)
    assert np.all(np.diff(found) > 0.0)
    expected = min(np.exp(-5.0 / points), 0.98)
    assert found[-1] == pytest.approx(expected)


WEIGHED = np.array([0.0, 0.2, 0.4, 0.6, 0.85, 0.95])
SHARP = -900.0 * (np.arctanh(WEIGHED) - np.arctanh(0.91)) ** 2


def found(log_evidence, of_the_likeliest=None) -> tuple[float, float]:
    """Return the likeliest coefficient and the mean of those that were weighed."""
    height = np.asarray(log_evidence, float)
    weight = np.exp(height - np.max(height))
    weight /= weight.sum()
    top = height if of_the_likeliest is None else np.asarray(of_the_likeliest)
    return correlation_between(WEIGHED, weight, top), float(weight @ WEIGHED)


def test_the_likeliest_lies_between_those_that_were_weighed():
    assert found(SHARP)[0] == pytest.approx(0.91, abs=1e-6)
    # However many rows there are.
    assert found(1e3 * SHARP)[0] == pytest.approx(0.91, abs=1e-6)


def test_where_nothing_lies_between_it_is_the_mean():
    several = -2.0 * (WEIGHED - 0.3) ** 2
    at_an_end = [0.0, -50.0, -90.0, -120.0, -300.0, -900.0]
    for height in (several, at_an_end):
        one, mean = found(height)
        assert one == mean
    # A remainder is weighed at some of them only, and may have no neighbours.
    one, mean = found(SHARP, np.where(WEIGHED == 0.95, SHARP, -np.inf))
    assert one == mean
