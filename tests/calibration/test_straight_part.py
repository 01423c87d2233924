"""The stiffness of a curve that is no line is that of its longest straight part."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Hdcal

import hdcal
from hdcal.calibration.straight_part import straight_check, takes_straight_part

GEAR = {
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def toe(contact: float = 0.3, rows: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Return a ramp to 1 mm with 80 N/mm from first contact on.

    Of a ramp from c on the best straight line has (1 − c)² (1 + 2 c) of its slope.
    """
    x = np.linspace(0.0, 1.0, rows)
    noise = np.random.default_rng(1).normal(0.0, 0.1, rows)
    return x, 80.0 * np.maximum(x - contact, 0.0) + noise


def read(x: np.ndarray, y: np.ndarray, **how) -> hdcal.Case:
    return hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=GEAR, **how)


def test_the_straight_part_of_a_toe_is_found():
    assert takes_straight_part(read(*toe()))
    x = np.asarray(read(*toe(), range="straight").records.deformation)
    # A tenth is left out where the straight part meets the toe.
    assert x[0] == pytest.approx(0.37, abs=0.05) and x[-1] == 1.0


def test_a_line_and_a_chosen_range_have_no_other_part():
    assert not takes_straight_part(read(*toe(contact=0.0)))
    assert not takes_straight_part(read(*toe(), range="all"))
    assert not takes_straight_part(read(*toe(), range="0.1:0.9"))
    x, y = toe()
    cycles = np.concatenate([x, x[::-1]] * 3), np.concatenate([y, y[::-1]] * 3)
    assert not takes_straight_part(read(*cycles))


def test_the_straight_part_has_one_branch():
    x = np.linspace(0.0, 1.0, 150)
    # A part that has yielded goes back along another line, over the same deformation.
    y = np.where(x < 0.6, 80.0 * x, 48.0 + 5.0 * (x - 0.6))
    back = x[:60:-1]
    case = read(np.r_[x, back], np.r_[y, 50.0 - 80.0 * (1.0 - back)], range="straight")
    place = np.asarray(case.records.deformation)
    assert place[0] == 0.0 and place[-1] == pytest.approx(0.54, abs=0.03)
    assert np.all(np.diff(place) > 0.0)


def test_a_model_far_from_the_straight_part_fails_and_names_its_range():
    case, rng = read(*toe()), np.random.default_rng(0)
    for middle, outcome in ((80.0, "passed"), (75.0, "passed"), (60.0, "failed")):
        found = straight_check(case, rng.normal(middle, 0.5, 500))
        assert found.outcome == outcome
    assert "range straight" in found.words


@pytest.mark.parametrize(("options", "expected"), [([], 80.0), (["--range=all"], 62.7)])
def test_calibrate_takes_the_straight_part_unless_all_is_asked_for(
    here: Hdcal, tmp_path: Path, options: list[str], expected: float
):
    table = np.column_stack(toe())
    np.savetxt(
        tmp_path / "toe.csv",
        table,
        "%.6f",
        ",",
        header="deformation_mm,force_N",
        comments="",
    )
    out = "--out", str(tmp_path / "result")
    done = here("calibrate", tmp_path / "toe.csv", "--json", *out, *options)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    middle = answer["stiffness_N_per_mm"]["median"]
    assert middle == pytest.approx(expected, rel=0.02)
    assert "no straight line" in answer["headline"]
