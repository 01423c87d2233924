"""A turning row is on the branch that its force fits."""

import numpy as np
import pytest

import hdcal

UP = np.linspace(0.0, 40.0, 31)
WAY = np.concatenate([UP, UP[-2::-1]])
TOP = 30


def _readings(before: bool, friction: float = 8.0, seed: int = 1) -> dict:
    sense = np.where(np.arange(WAY.size) < TOP + before, 1.0, -1.0)
    noise = np.random.default_rng(seed).normal(0.0, 0.3, WAY.size)
    force = 20.0 + 6.0 * WAY + friction * sense + noise
    return {"deformation_mm": WAY, "force_N": force}


@pytest.mark.parametrize("before", [True, False])
def test_the_turning_row_is_on_the_branch_of_its_force(before):
    sense = np.asarray(hdcal.read_case(_readings(before)).records.sense)
    assert sense[TOP] == (1.0 if before else -1.0)
    assert np.all(sense[:TOP] == 1.0)
    assert np.all(sense[TOP + 1 :] == -1.0)


def test_without_a_loop_the_turning_row_counts_as_loading():
    for seed in range(50):
        case = hdcal.read_case(_readings(True, friction=0.0, seed=seed))
        assert case.records.sense[TOP] == 1.0


def test_the_diagnosis_is_the_same_on_either_side():
    found = [
        hdcal.diagnose(hdcal.read_case(_readings(before)), quick=True)
        for before in (True, False)
    ]
    for each in found:
        assert each.which.causes[0].members[0] == "coulomb_friction"
        assert each.which.inclusion["coulomb_friction"] > 0.95
    first, second = (each.which.inclusion for each in found)
    assert first == pytest.approx(second, abs=0.03)
    closed = [each.how_far.closed.median for each in found]
    assert closed[0] == pytest.approx(closed[1], abs=0.02)


def test_a_reading_that_repeats_the_top_is_on_the_branch_of_its_force():
    rows = _readings(False)
    twice = {name: np.insert(v, TOP, v[TOP]) for name, v in rows.items()}
    twice["force_N"][TOP] += 16.0
    sense = hdcal.read_case(twice).records.sense
    assert sense[TOP : TOP + 2].tolist() == [1.0, -1.0]
