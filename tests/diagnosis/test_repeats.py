"""A reading that repeats a turning point is of loading or of unloading: left out."""

import numpy as np
import pytest

import hdcal
from hdcal.diagnosis.repeats import without_repeats

UP = np.linspace(0.0, 0.5, 13)
# As an array that is mirrored gives it: the top twice.
WAY = np.concatenate([UP, UP[::-1]])
SENSE = np.repeat([1.0, -1.0], len(UP))


def _case(way=WAY, runs=4, friction=1.2):
    rng = np.random.default_rng(0)
    sense = np.resize(SENSE, len(way))
    force = np.concatenate(
        [
            190.0 * way
            + friction * sense
            + rng.normal(0.0, 0.8)
            + rng.normal(0.0, 0.25, len(way))
            for _ in range(runs)
        ]
    )
    run = np.repeat(np.arange(runs), len(way))
    x = np.tile(way, runs)
    return hdcal.read_case({"deformation_mm": x, "force_N": force, "run": run})


def test_the_second_reading_of_each_turn_is_left_out():
    case, repeated = without_repeats(_case())
    assert repeated == 4
    kept = np.delete(np.arange(104), [13, 39, 65, 91])
    assert np.array_equal(case.records.force, np.asarray(_case().records.force)[kept])


@pytest.mark.parametrize(
    "way",
    [
        np.concatenate([UP, UP[-2::-1]]),  # the top once
        np.concatenate([UP, [0.5, 0.5], UP[::-1]]),  # a hold
        np.repeat(UP, 2),  # each place twice, on the way up
        np.concatenate([UP, [0.5]]),  # the end
    ],
)
def test_holds_ends_and_steps_stay(way):
    assert without_repeats(_case(way))[1] == 0


def test_where_the_time_was_read_a_repeated_reading_may_be_a_hold():
    x, time = np.tile(WAY, 2), np.tile(np.arange(26.0), 2)
    rows = {"deformation_mm": x, "force_N": 190.0 * x, "time_s": time}
    rows["run"] = np.repeat([0, 1], 26)
    assert without_repeats(hdcal.read_case(rows))[1] == 0


@pytest.mark.thorough
def test_friction_is_named_whichever_side_the_repeated_top_was_read_on():
    verdict = hdcal.diagnose(_case(), quick=True)
    assert "coulomb_friction" in verdict.which.named
    assert any("4 readings that repeat a turning" in note for note in verdict.notes)
    assert not any("repeat" in n for n in hdcal.diagnose(_case(UP), quick=True).notes)
