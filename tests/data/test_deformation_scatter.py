"""Scatter of the displacement gauge is removed where the force does not follow it."""

import numpy as np
import pytest
from scipy import stats

import hdcal

ROWS = 200
RAMP = np.linspace(0.0, 0.2, ROWS)


def read(x: np.ndarray, y: np.ndarray) -> hdcal.Case:
    return hdcal.read_case({"deformation_mm": x, "force_N": y})


@pytest.mark.parametrize("seed", range(5))
def test_regression_dilution_is_removed(seed: int):
    rng = np.random.default_rng(seed)
    force = 100.0 * RAMP + rng.normal(0.0, 0.1, ROWS)
    scattered = RAMP + rng.normal(0.0, 0.03, ROWS)
    assert stats.linregress(scattered, force).slope < 88.0
    case = read(scattered, force)
    line = stats.linregress(case.records.deformation, case.records.force)
    assert abs(line.slope - 100.0) < 2.5 * line.stderr
    # The scatter is now in the force: its sd is that of the deformation times slope.
    expected = 100.0 * 0.03 / (np.std(RAMP) * np.sqrt(ROWS))
    assert line.stderr == pytest.approx(expected, rel=0.25)
    assert case.screening is not None
    assert case.screening.deformation_sd == pytest.approx(0.03, rel=0.25)
    assert "unloading" not in case.records.known


@pytest.mark.parametrize("seed", range(5))
def test_a_part_that_trembles_itself_is_left_as_read(seed: int):
    rng = np.random.default_rng(seed)
    moved = RAMP + rng.normal(0.0, 0.03, ROWS)
    case = read(moved, 100.0 * moved + rng.normal(0.0, 0.1, ROWS))
    np.testing.assert_array_equal(case.records.deformation, moved)


def test_clean_loops_holds_and_steps_are_left_as_read():
    rng = np.random.default_rng(0)
    up = np.linspace(0.0, 1.0, 100)
    for path in (
        np.concatenate([up, up[::-1]]),
        np.repeat(np.linspace(0.0, 1.0, 20), 10),
        np.sin(np.linspace(0.0, 9.0, ROWS)),
    ):
        case = read(path, 50.0 * path + rng.normal(0.0, 0.5, len(path)))
        np.testing.assert_array_equal(case.records.deformation, path)
