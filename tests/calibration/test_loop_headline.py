"""Beside the number stands what may move it farther than its interval."""

import numpy as np
import pytest

import hdcal
from hdcal.calibration.loop_stiffness import loop_stiffness

STIFFNESS, RANGE = 108.0, 0.45
UP = np.linspace(0.0, RANGE, 30)
PATH = np.concatenate([UP, UP[-2::-1]])
ENDS = np.array([0.025, 0.5, 0.975])


def _dahl(x, reach=0.05):
    """Return a loop that closes on its end exponentially, of unit half width."""
    moves, state, found = np.diff(x, prepend=0.0), 0.0, []
    for move in moves:
        state += (np.sign(move) - state) * (1.0 - np.exp(-abs(move) / reach))
        found.append(state)
    return np.array(found)


def _jenkins(x, reach=0.08):
    """Return a loop of one cell that sticks and slips."""
    state, found = 0.0, []
    for move in np.diff(x, prepend=0.0):
        state = np.clip(state + move / reach, -1.0, 1.0)
        found.append(state)
    return np.array(found)


def _opening(x):
    """Return a loop that opens with the load."""
    return np.where(np.arange(len(x)) < len(UP), 1.0, -1.0) * x / RANGE


def rig(loop, seed=0, width=1.0, runs=4, noise=0.25, alike=0.7, **labels):
    """Return readings of several mountings, whose neighbours err alike."""
    rng = np.random.default_rng(seed)
    force = []
    for _ in range(runs):
        error = [rng.normal()]
        for _ in PATH[1:]:
            step = np.sqrt(1.0 - alike**2) * rng.normal()
            error.append(alike * error[-1] + step)
        zero = rng.normal(0.0, 0.8)
        force.append(
            STIFFNESS * PATH + zero + width * loop(PATH) + noise * np.array(error)
        )
    return hdcal.read_case(
        {
            "deformation_mm": np.tile(PATH, runs),
            "force_N": np.concatenate(force),
            "run": np.repeat(np.arange(runs), len(PATH)),
            **labels,
        }
    )


def calibrated(case, effects=()):
    return hdcal.calibrate(case, effects=effects, warmup=500, draws=1000)


@pytest.mark.parametrize("loop", [_dahl, _jenkins, _opening])
def test_the_stiffness_beside_a_loop_of_any_shape_is_covered(loop):
    found = np.array([loop_stiffness(rig(loop, seed), ENDS) for seed in range(20)])
    low, middle, high = found.T
    assert np.mean((low < STIFFNESS) & (high > STIFFNESS)) >= 0.85
    assert abs(np.mean(middle) - STIFFNESS) < 0.5
    # A line alone is off by 3 N/mm where the loop is no even one.
    assert np.median(high - low) < 5.0


def test_without_a_loop_its_room_costs_little():
    found = [loop_stiffness(rig(_dahl, s, width=0.0), ENDS) for s in range(20)]
    low, middle, high = np.array(found).T
    assert np.mean((low < STIFFNESS) & (high > STIFFNESS)) >= 0.85
    assert np.median(high - low) < 2.0
    assert abs(np.mean(middle) - STIFFNESS) < 0.3


def test_of_several_specimens_or_loading_alone_no_loop_is_asked():
    gears = np.repeat([0, 0, 1, 1], len(PATH))
    assert loop_stiffness(rig(_dahl, specimen=gears), ENDS) is None
    up = hdcal.read_case({"deformation_mm": UP, "force_N": STIFFNESS * UP + UP**2})
    assert loop_stiffness(up, ENDS) is None


@pytest.mark.parametrize("width", [0.0, 1.0])
def test_a_loop_that_the_model_lacks_is_said_in_the_headline(width: float):
    found = hdcal.summarise(calibrated(rig(_dahl, width=width)))
    beside = found["beside_a_loop"]
    assert ("beside a loop of any shape it is" in found["headline"]) == bool(width)
    assert (beside is not None) == bool(width)
    if width:
        line = found["stiffness_N_per_mm"]
        assert line["lo"] > STIFFNESS
        assert beside["lo"] < STIFFNESS < beside["hi"]


@pytest.mark.thorough
def test_a_loop_that_is_in_the_model_is_not_asked_about():
    case = rig(_jenkins, runs=1)
    found = calibrated(case, effects=["hysteresis"])
    assert hdcal.summarise(found)["beside_a_loop"] is None


@pytest.mark.thorough
def test_the_stiffness_of_several_specimens_is_said_to_be_their_mean():
    labels, factors = np.repeat([*"abc"], 2 * len(PATH)), np.array([1.0, 1.1, 0.95])
    case = rig(_dahl, width=0.0, runs=6, specimen=labels)
    force = np.asarray(case.records.force) * np.repeat(factors, 2 * len(PATH))
    rows = {"deformation_mm": np.tile(PATH, 6), "force_N": force, "specimen": labels}
    rows["run"] = np.repeat(np.arange(6), len(PATH))
    found = hdcal.summarise(calibrated(hdcal.read_case(rows)))
    assert found["headline"].startswith("Mean stiffness of the 3 gears tested")
    assert found["next_steps"][0].startswith("Look at the gears one by one")
    for name, factor in zip("abc", factors, strict=True):
        own, truth = found["specimens"][name], STIFFNESS * factor
        assert own["lo"] < truth < own["hi"]
        assert own["hi"] - own["lo"] < 4.0
