"""Noise that errs alike for long is allowed for where a rig is read often."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdcal.diagnosis.model_posterior import ModelPosterior
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


def posterior(log_weight) -> ModelPosterior:
    weight = np.exp(np.asarray(log_weight) - np.max(log_weight))
    return ModelPosterior({}, {}, weight / weight.sum(), {})


def test_the_likeliest_lies_between_those_that_were_weighed():
    weighed, true = np.array([0.0, 0.2, 0.4, 0.6, 0.85, 0.95]), 0.91
    far = -900.0 * (np.arctanh(weighed) - np.arctanh(true)) ** 2
    assert posterior(far).correlation_between(weighed) == pytest.approx(true, abs=1e-6)
    # Few rows leave several, and at an end there is nothing beyond.
    near = -2.0 * (weighed - 0.3) ** 2
    about = posterior(near)
    assert about.correlation_between(weighed) == about.correlation @ weighed
    end = posterior([0.0, -50.0, -90.0, -120.0, -300.0, -900.0])
    assert end.correlation_between(weighed) == pytest.approx(0.0, abs=1e-12)
