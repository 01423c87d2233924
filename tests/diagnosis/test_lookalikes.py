"""What another loading would be needed to exclude is not excluded by a name."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from rigs import ramp

SATURATES = {"force_saturation": {"curvature": 3e-6}}


def names(which) -> set[str]:
    return {each.effect for each in which.lookalikes}


@pytest.mark.thorough
def test_on_one_ramp_a_sensor_that_saturates_may_be_a_wall_that_yields():
    verdict = judged(simulated(ramp(60), SATURATES, seed=3))
    which = verdict.which
    assert verdict.gap.detected
    assert which.verdict in ("group", "ambiguous")
    assert "plastic_yield" in names(which)
    (needs,) = [x.needs for x in which.lookalikes if x.effect == "plastic_yield"]
    assert needs == ("unloading",)


@pytest.mark.thorough
def test_unloading_tells_them_apart():
    which = judged(simulated(rich(), SATURATES, seed=3)).which
    assert "curve down" in (which.group or "")
    assert not names(which)


def rounded(case, step: float):
    force = step * np.round(np.asarray(case.records.force) / step)
    return replace(case, records=replace(case.records, force=force))


@pytest.mark.thorough
def test_a_coarse_display_does_not_name_what_fine_readings_do_not():
    which = judged(rounded(simulated(ramp(60), SATURATES, seed=3), 0.5)).which
    assert which.verdict != "named"
    assert which.effect != "quantisation"


def test_behind_a_coarse_display_the_unknown_stays_unknown():
    case = simulated(rich(), seed=5)
    w, t = np.asarray(case.records.deformation), np.asarray(case.records.time)
    swing = 5.0 * (w / 0.54) * np.sin(2.0 * np.pi * t / (0.37 * t.max()))
    case = replace(
        case, records=replace(case.records, force=case.records.force + swing)
    )
    assert judged(case).which.verdict == "unknown"
    assert judged(rounded(case, 0.98)).which.verdict == "unknown"


@pytest.mark.thorough
def test_a_kink_upwards_is_no_yield():
    kink = {"contact_onset": {"ratio": 0.3, "onset": 0.3}}
    which = judged(simulated(ramp(60), kink, seed=3)).which
    assert which.effect in ("contact_onset", "progressive_stiffening")
    assert "plastic_yield" not in names(which)
