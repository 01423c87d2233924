"""A stream that begins with priors says for which full scale they are."""

import pytest
from rigs import make_gear

from hdcal.data.prior import Prior
from hdcal.data.priors import rig_priors
from hdcal.tracking.full_scale import AssumedFullScale
from hdcal.tracking.tracker import Tracker

NAMES = ("force_offset", "sigma", "run_offset_sd")


@pytest.fixture
def shipped():
    priors = rig_priors()
    return make_gear(**{name: priors[name] for name in NAMES})


def test_what_is_assumed_is_said_at_the_start(shipped):
    words = Tracker(shipped).describe()
    assert "priors of force_offset, sigma, run_offset_sd" in words
    assert "up to 100 N" in words


def test_what_the_gear_file_states_is_not_assumed(shipped):
    own = {name: Prior("fixed", (1.0,), source="mine") for name in NAMES}
    assert AssumedFullScale(make_gear(**own)).at_start() == []
    (words,) = AssumedFullScale(
        make_gear(**{**own, "sigma": shipped.priors["sigma"]})
    ).at_start()
    assert "priors of sigma are" in words


@pytest.mark.parametrize(("largest", "said"), [(95.0, False), (4e3, True), (2.0, True)])
def test_readings_of_another_full_scale_are_told(shipped, largest, said):
    tracker = Tracker(shipped)
    tracker.update(0.2, -0.3 * largest)
    tracker.update(0.4, -largest)
    assert (f"largest force is {largest:.3g} N" in tracker.summary()) is said
