"""A mirrored stream is answered by mirrored forces and the same alarms."""

import numpy as np
import pytest
from mirrored import mirrored
from posteriors import plain_draws, ramp_case, single, written_posterior
from rigs import make_gear

from hdcal import Tracker
from hdcal.data.prior import Prior

# A zero of the mounting that is drawn at random would not be mirrored.
GEAR = make_gear(run_offset_sd=Prior("fixed", (0.0,)))


def bent():
    case = ramp_case(GEAR)
    draws = plain_draws(case, 512)
    draws["progressive_stiffening.slope"] = np.linspace(0.2, 0.4, 512)
    return written_posterior(case, draws, effects=["progressive_stiffening"])


@pytest.mark.parametrize("make", [lambda: single(GEAR, 512), bent])
def test_the_stream_is_mirrored(make):
    known = make()
    trackers = Tracker(known, alarm_rows=100), Tracker(mirrored(known), alarm_rows=100)
    rng, alarms = np.random.default_rng(4), 0
    for row in range(120):
        at, warm = rng.uniform(0.05, 0.6), rng.uniform(15.0, 25.0)
        stiffness = 205.0 if row < 60 else 180.0
        force = stiffness * at - 1.0 + rng.normal(0.0, 0.6)
        found, other = (
            tracker.update(sign * at, sign * force, temperature=warm)
            for tracker, sign in zip(trackers, (1.0, -1.0), strict=True)
        )
        same = ("row", "status", "alarm", "alarm_since_row", "tested")
        assert [found[name] for name in same] == [other[name] for name in same]
        for name in ("innovation", "alarm_score"):
            assert other[name] == pytest.approx(-found[name], rel=1e-7, abs=1e-9)
        force, turned = found["force_N"], other["force_N"]
        assert turned["predicted"] == pytest.approx(-force["predicted"], rel=1e-9)
        low, high = force["predictive_95"]
        assert turned["predictive_95"] == pytest.approx([-high, -low], rel=1e-9)
        mean = found["stiffness_N_per_mm"]["mean"]
        assert other["stiffness_N_per_mm"]["mean"] == pytest.approx(mean, rel=1e-9)
        alarms += found["alarm"]
    assert alarms > 0


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("at", "force"), [(45.0, 90.0), (0.4, 1e13)])
def test_what_is_no_reading_is_refused_in_either_sense(sense, at, force):
    tracker = Tracker(single(GEAR, 512))
    with pytest.raises(ValueError, match=r"none of this gear|does not lie between"):
        tracker.update(sense * at, sense * force)
