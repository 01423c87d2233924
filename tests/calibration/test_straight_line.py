"""The stiffness is that of a robust line, over the longest straight part of a curve."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Hdcal

import hdcal
from hdcal.calibration.straight_line import (
    line_check,
    robust_line,
    straight_check,
    takes_straight_part,
)
from hdcal.errors import InputError

GEAR = {
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def read(x: np.ndarray, y: np.ndarray, **how) -> hdcal.Case:
    return hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=GEAR, **how)


def test_a_few_wild_readings_do_not_move_the_line():
    x = np.linspace(0.0, 0.5, 100)
    y = 200.0 * x + 3.0 + np.random.default_rng(0).normal(0.0, 0.5, 100)
    y[[20, 60, 80]] += 500.0
    line = robust_line(read(x, y).records)
    assert line is not None
    assert line.slope == pytest.approx(200.0, abs=2.0 * line.half_width)
    assert line.half_width < 2.0


@pytest.mark.parametrize(
    ("middle", "sd", "outcome"),
    [
        (200.0, 1.0, "passed"),
        (215.0, 1.0, "passed"),
        (150.0, 1.0, "failed"),
        # So wide an interval excludes nothing.
        (150.0, 40.0, "passed"),
    ],
)
def test_only_a_stiffness_that_is_far_off_fails(middle, sd, outcome):
    rng, x = np.random.default_rng(1), np.linspace(0.0, 0.5, 100)
    records = read(x, 200.0 * x + rng.normal(0.0, 0.5, 100)).records
    draws = rng.normal(middle, sd, 1000)
    assert line_check(records, draws, sized=False).outcome == outcome


def test_a_stiffness_of_unknown_sign_fails_without_sizes():
    rng = np.random.default_rng(2)
    records = read(np.linspace(0.0, 0.5, 20), rng.normal(0.0, 100.0, 20)).records
    draws = np.abs(rng.normal(100.0, 80.0, 1000))
    assert line_check(records, draws, sized=False).outcome == "failed"
    assert line_check(records, draws, sized=True).outcome == "passed"


def toe(contact: float = 0.3, rows: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Return a ramp to 1 mm with 80 N/mm from first contact on.

    Of a ramp from c on the best straight line has (1 − c)² (1 + 2 c) of its slope.
    """
    x = np.linspace(0.0, 1.0, rows)
    noise = np.random.default_rng(1).normal(0.0, 0.1, rows)
    return x, 80.0 * np.maximum(x - contact, 0.0) + noise


def two_branches() -> tuple[np.ndarray, np.ndarray]:
    """Return a part of 80 N/mm that yields by 4 mm, and its unloading."""
    up = np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 5.0, 60)]
    down = np.linspace(5.0, 4.0, 60)
    force = np.r_[80.0 * np.minimum(up, 1.0), 80.0 * (down - 4.0)]
    return np.r_[up, down], force + np.random.default_rng(2).normal(0.0, 0.05, 180)


def test_the_straight_part_of_a_toe_is_taken():
    assert takes_straight_part(read(*toe()))
    x = np.asarray(read(*toe(), range="straight").records.deformation)
    # A tenth is left out where the straight part meets the toe.
    assert x[0] == pytest.approx(0.37, abs=0.05) and x[-1] == 1.0
    assert not takes_straight_part(read(*toe(contact=0.0)))
    for chosen in ("all", "0.1:0.9"):
        assert not takes_straight_part(read(*toe(), range=chosen))


def test_cycles_share_what_is_parallel_of_them():
    x, y = toe()
    cycles = np.concatenate([x, x[::-1]] * 3), np.concatenate([y, y[::-1]] * 3)
    part = read(*cycles).screening.straight
    assert part.slope == pytest.approx(80.0, rel=0.002) and not part.whole
    assert (part.low, part.high) == pytest.approx((0.37, 1.0), abs=0.05)
    assert takes_straight_part(read(*cycles))
    kept = read(*cycles, range="straight")
    assert kept.excluded_sense == 0 and len(kept.records.force) == part.rows.sum()
    # A loop that is wider the farther it goes has no parallel branches.
    wide = cycles[1] + 20.0 * cycles[0] * np.sign(np.gradient(cycles[0]))
    assert read(cycles[0], wide).screening.straight is None


@pytest.mark.parametrize(("middle", "outcome"), [(75.0, "passed"), (60.0, "failed")])
def test_a_model_far_from_the_straight_part_fails(middle, outcome):
    assert straight_check(read(*toe()), np.full(500, middle)).outcome == outcome


def test_a_range_with_branches_on_two_lines_fails():
    case = read(*two_branches(), range="10%:50%")
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    slope = float(np.polyfit(x, y, 1)[0])
    # Half of the force comes again 4 mm farther on.
    assert abs(slope) < 10.0
    assert straight_check(case, np.full(500, slope)).outcome == "failed"
    assert straight_check(case, np.full(500, 80.0)).outcome == "passed"
    # Each remedy that the check names gives the stiffness.
    for remedy in ("straight", "0.1:0.5"):
        kept = read(*two_branches(), range=remedy).records
        line = np.polyfit(kept.deformation, kept.force, 1)
        assert line[0] == pytest.approx(80.0, rel=0.01)


def test_the_first_loading_is_taken_and_the_other_branch_is_not_predicted():
    case = read(*two_branches(), range="straight")
    x = np.asarray(case.records.deformation)
    assert x[0] == 0.0 and x[-1] == pytest.approx(0.9, abs=0.03)
    assert np.all(np.diff(x) > 0.0) and case.excluded_sense == 0
    # Of a loop both branches are between the ends: parallel ones are one part.
    x, y = toe(contact=0.0)
    y[:30] -= 10.0 * np.linspace(1.0, 0.0, 30)
    loop, back = np.r_[x, x[-2::-1]], 80.0 * x[::-1] - 8.0
    both = read(loop, np.r_[y, back[1:]], range="straight")
    assert both.excluded_sense == 0 and {*np.asarray(both.records.sense)} == {-1, 1}
    back = 70.0 * x[::-1] + 2.0
    case = read(loop, np.r_[y, back[1:]], range="straight")
    assert case.excluded_sense == -1
    posterior = hdcal.calibrate(case, warmup=300, draws=500)
    assert hdcal.predict(posterior, [0.5], direction="up").direction == ["up"]
    with pytest.raises(InputError, match="left out the readings"):
        hdcal.predict(posterior, [0.5], direction="down")
    with pytest.raises(InputError, match="left out the readings"):
        hdcal.margin(posterior, 0.5, direction="down")


@pytest.mark.parametrize(
    ("options", "expected"),
    [([], 80.0), pytest.param(["--range=all"], 62.7, marks=pytest.mark.thorough)],
)
def test_calibrate_takes_the_straight_part_unless_all_is_asked_for(
    here: Hdcal, tmp_path: Path, options: list[str], expected: float
):
    table = "\n".join(f"{x:.6f},{y:.6f}" for x, y in zip(*toe(), strict=True))
    (tmp_path / "toe.csv").write_text(f"deformation_mm,force_N\n{table}\n")
    size = "--warmup", "300", "--draws", "500", "--out", "result", "--json"
    done = here("calibrate", "toe.csv", *size, *options)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    middle = answer["stiffness_N_per_mm"]["median"]
    assert middle == pytest.approx(expected, rel=0.02)
    assert "not straight" in answer["headline"]
