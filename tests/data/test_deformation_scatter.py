"""Scatter of the displacement gauge is removed where the force does not follow it."""

import numpy as np
import pytest
from scipy import stats

import hdcal
from hdcal.data.deformation_scatter import without_scatter

ROWS = 200
RAMP = np.linspace(0.0, 0.2, ROWS)
ONE_RUN = np.zeros(ROWS, int)


def slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.polyfit(x, y, 1)[0])


@pytest.mark.parametrize("seed", range(5))
def test_regression_dilution_is_removed(seed: int):
    rng = np.random.default_rng(seed)
    force = 100.0 * RAMP + rng.normal(0.0, 0.1, ROWS)
    read = RAMP + rng.normal(0.0, 0.03, ROWS)
    assert slope(read, force) < 88.0
    steady, moved, scatter = without_scatter(read, force, ONE_RUN)
    line = stats.linregress(steady, moved)
    assert abs(line.slope - 100.0) < 2.5 * line.stderr
    # The scatter is now in the force: its sd is that of the deformation times slope.
    expected = 100.0 * 0.03 / (np.std(RAMP) * np.sqrt(ROWS))
    assert line.stderr == pytest.approx(expected, rel=0.25)
    assert scatter == pytest.approx(0.03, rel=0.25)


@pytest.mark.parametrize("seed", range(5))
def test_a_part_that_trembles_itself_is_left_as_read(seed: int):
    rng = np.random.default_rng(seed)
    moved = RAMP + rng.normal(0.0, 0.03, ROWS)
    force = 100.0 * moved + rng.normal(0.0, 0.1, ROWS)
    steady, _, scatter = without_scatter(moved, force, ONE_RUN)
    assert scatter == 0.0
    np.testing.assert_array_equal(steady, moved)


def test_clean_loops_holds_and_steps_are_left_as_read():
    rng = np.random.default_rng(0)
    up = np.linspace(0.0, 1.0, 100)
    for path in (
        np.concatenate([up, up[::-1]]),
        np.repeat(np.linspace(0.0, 1.0, 20), 10),
        np.sin(np.linspace(0.0, 9.0, ROWS)),
    ):
        force = 50.0 * path + rng.normal(0.0, 0.5, len(path))
        assert without_scatter(path, force, ONE_RUN)[2] == 0.0


def test_a_case_says_that_it_was_smoothed():
    rng = np.random.default_rng(1)
    force = 100.0 * RAMP + rng.normal(0.0, 0.1, ROWS)
    read = {"deformation_mm": RAMP + rng.normal(0.0, 0.03, ROWS), "force_N": force}
    gear = {
        "theory": "spring",
        "deformation": "radial",
        "reference_temperature_C": 20.0,
    }
    case = hdcal.read_case(read, gear=gear)
    assert any("gauge scatters by 0.0" in note for note in case.notes)
