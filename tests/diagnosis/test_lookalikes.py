"""What another loading would be needed to exclude is not excluded by a name."""

from diagnosis_cases import judged, rich, simulated
from rigs import ramp

SATURATES = {"force_saturation": {"curvature": 3e-6}}


def names(which) -> set[str]:
    return {each.effect for each in which.lookalikes}


def test_on_one_ramp_a_sensor_that_saturates_may_be_a_wall_that_yields():
    verdict = judged(simulated(ramp(60), SATURATES, seed=3))
    which = verdict.which
    assert verdict.gap.detected
    assert which.verdict in ("group", "ambiguous")
    assert "plastic_yield" in names(which)
    (needs,) = [x.needs for x in which.lookalikes if x.effect == "plastic_yield"]
    assert needs == ("unloading",)


def test_unloading_tells_them_apart():
    which = judged(simulated(rich(), SATURATES, seed=3)).which
    assert "curve down" in (which.group or "")
    assert not names(which)
