"""A case is screened when it is read, and every command says what was done."""

import json

import numpy as np
import pandas as pd
import pytest

import hdcal
from hdcal.calibration.check.check import check
from hdcal.errors import InputError
from hdcal.prediction.bands.predict import default_bands

RNG = np.random.default_rng(4)
START = RNG.bit_generator.state
ROWS = 120


@pytest.fixture(autouse=True)
def same_numbers():
    """Let the numbers of a test not depend on which tests ran before it."""
    RNG.bit_generator.state = START


def table(**columns):
    x = np.linspace(0.0, 1.0, ROWS)
    force = 20.0 * x + RNG.normal(0.0, 0.02, ROWS)
    return pd.DataFrame({"deformation_mm": x, "force_N": force} | columns)


def test_cut_rows_leave_the_records():
    frame = table()
    frame.loc[[30, 70], "force_N"] += 90.0
    case = hdcal.read_case(frame)
    assert len(case.records.force) == ROWS - 2
    assert case.screening.kept.sum() == ROWS - 2
    assert any("outliers" in note and "rows 32, 72" in note for note in case.notes)


def test_direction_is_not_derived_from_a_trembling_gauge():
    frame = table()
    frame["deformation_mm"] += RNG.normal(0.0, 0.1, ROWS)
    case = hdcal.read_case(frame)
    assert case.screening.trembling
    assert (case.records.direction == 1.0).all()
    assert "unloading" not in case.records.known


def test_check_shows_findings_segments_and_the_straight_part():
    frame = table()
    frame.loc[80:, "force_N"] = 2.0
    found = check(hdcal.read_case(frame))
    answer = json.loads(found.to_json())["screening"]
    (one,) = answer["findings"]
    assert (one["kind"], one["row_count"]) == ("after the largest force", 40)
    assert answer["segments"] == {"loading": 80, "after the largest force": 40}
    assert answer["straight_part"]["whole"]
    labels = [mark.label for mark in found.charts()["readings"].panels[0].marks]
    assert labels == ["", "left out: after the largest force"]


def test_a_gear_with_a_negative_slope_can_be_left_out():
    good = table(specimen="A")
    bad = table(specimen="B")
    bad["force_N"] = 12.0 * np.sin(25.0 * bad["deformation_mm"]) - bad["force_N"]
    both = pd.concat([good, bad])
    with pytest.raises(InputError, match="falls as the deformation grows"):
        hdcal.read_case(both)
    case = hdcal.read_case(both, skip_bad=True)
    assert case.specimen_labels == ("A",)
    assert [*case.left_out] == ["B"]


def test_what_a_part_gave_way_at_is_not_predicted(tmp_path):
    """A part whose readings begin at 120 mm gives way at 120.7 mm."""
    frame = table()
    frame["deformation_mm"] += 120.0
    frame.loc[84:, "force_N"] = 1.0
    broken = hdcal.calibrate(hdcal.read_case(frame), warmup=500, draws=1000)
    (low, high) = broken.case.excluded[0]
    assert low == pytest.approx(120.7, abs=0.01) and high == np.inf
    for at in (120.8, 121.2):
        with pytest.raises(InputError, match="left out"):
            hdcal.margin(broken, at, limit_force=40.0)
        with pytest.raises(InputError, match="left out"):
            hdcal.predict(broken, [120.5, at])
    with pytest.raises(InputError, match="first contact"):
        hdcal.margin(broken, 120.5, quantity="load")
    bands = default_bands(broken)
    assert bands.deformation_mm.min() > 119.0 and bands.deformation_mm.max() < 122.0
    broken.save(tmp_path / "posterior.nc")
    back = hdcal.Posterior.load(tmp_path / "posterior.nc")
    assert back.case.excluded == broken.case.excluded


def test_rows_after_a_jump_are_a_run_of_their_own():
    frame = table()
    frame.loc[60:, "force_N"] += 11.0
    case = hdcal.read_case(frame)
    assert case.run_labels == ("1", "1 (zero 2)")
    np.testing.assert_array_equal(case.records.run, np.arange(ROWS) >= 60)
    assert np.ptp(case.records.force) == pytest.approx(20.0, abs=0.2)
