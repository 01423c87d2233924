"""A stiffness far from a robust straight line fails."""

import numpy as np
import pytest

from hdcal import read_case
from hdcal.data.records import Records
from hdcal.inference.straight_line import line_check, robust_line

SPRING = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def records_of(x: np.ndarray, y: np.ndarray) -> Records:
    return read_case({"deformation_mm": x, "force_N": y}, gear=SPRING).records


def test_a_few_wild_readings_do_not_move_the_line():
    rng = np.random.default_rng(0)
    x = np.linspace(0.0, 0.5, 100)
    y = 200.0 * x + 3.0 + rng.normal(0.0, 0.5, 100)
    y[[20, 60, 80]] += 500.0
    line = robust_line(records_of(x, y))
    assert line is not None
    assert line.slope == pytest.approx(200.0, abs=2.0 * line.half_width)


def test_only_a_stiffness_that_is_far_off_fails():
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 0.5, 100)
    records = records_of(x, 200.0 * x + rng.normal(0.0, 0.5, 100))
    for middle, outcome in ((200.0, "passed"), (215.0, "passed"), (150.0, "failed")):
        draws = rng.normal(middle, 1.0, 1000)
        assert line_check(records, draws, sized=False).outcome == outcome
    # So wide an interval says that it does not know.
    wide = rng.normal(150.0, 40.0, 1000)
    assert line_check(records, wide, sized=False).outcome == "passed"


def test_a_stiffness_whose_sign_the_readings_do_not_tell_fails_without_sizes():
    rng = np.random.default_rng(2)
    records = records_of(np.linspace(0.0, 0.5, 20), rng.normal(0.0, 100.0, 20))
    draws = np.abs(rng.normal(100.0, 80.0, 1000))
    assert line_check(records, draws, sized=False).outcome == "failed"
    assert line_check(records, draws, sized=True).outcome == "passed"
