"""A working range leaves only the rows between its ends."""

import json

import numpy as np
import pandas as pd
import pytest

import hdcal
from hdcal.errors import InputError
from hdcal.screening.working_range import WorkingRange, read_range

X = np.linspace(0.0, 1.0, 101)
TABLE = pd.DataFrame({"deformation_mm": X, "force_N": 20.0 * X})
SIZES = {"wall_thickness_mm": 0.7, "radius_mm": 40.0, "length_mm": 70.0}


def test_both_forms_are_read():
    assert read_range("0.1:0.6") == WorkingRange(0.1, 0.6, "mm")
    assert read_range(" -2 : -1.5 ") == WorkingRange(-2.0, -1.5, "mm")
    assert read_range("10%:40%") == WorkingRange(10.0, 40.0, "%")


@pytest.mark.parametrize(
    "text", ["", "1", "a:b", "1:2:3", "10%:40", "2:1", "10%:140%", "nan:1", "1:inf"]
)
def test_what_is_no_range_is_refused(text):
    with pytest.raises(InputError, match="range"):
        hdcal.read_case(TABLE, range=text)


@pytest.mark.parametrize("text", ["0.105:0.405", "10.5%:40.5%"])
def test_rows_outside_leave_the_records(text):
    case = hdcal.read_case(TABLE, range=text)
    np.testing.assert_allclose(case.records.deformation, X[11:41])
    assert (~case.screening.kept).sum() == 71
    ends = np.ravel(sorted(case.excluded))
    np.testing.assert_allclose(ends, [0.0, 0.11, 0.4, 1.0], atol=1e-12)


def test_the_gear_file_may_state_it_and_the_caller_overrides_it():
    gear = {**SIZES, "range": "10.5%:40.5%"}
    assert len(hdcal.read_case(TABLE, gear).records.force) == 30
    assert len(hdcal.read_case(TABLE, gear, range="0:0.5").records.force) == 51
    with pytest.raises(InputError, match="is not a range"):
        hdcal.read_case(TABLE, {**SIZES, "range": "from 1 to 2"})
    with pytest.raises(InputError, match=r"2 of 101 rows.*from 0 to 1 mm"):
        hdcal.read_case(TABLE, range="0.10:0.115")


def test_a_force_that_falls_in_places_is_asked_about_and_answered_by_a_range():
    """It falls at first, and rises by 20 N/mm from 2 to 4 mm."""
    x = np.linspace(0.0, 10.0, 200)
    force = 20.0 * x + np.random.default_rng(1).normal(0.0, 0.2, 200)
    data = {"deformation_mm": x, "force_N": force + 28.0 * (np.abs(x % 4.0 - 2.0) - x)}
    with pytest.raises(InputError, match="by `range`"):
        hdcal.read_case(data)
    records = hdcal.read_case(data, range="2.05:3.95").records
    slope = np.polyfit(records.deformation, records.force, 1)[0]
    assert slope == pytest.approx(20.0, rel=4e-3)


def test_a_command_takes_it(tmp_path, here):
    TABLE.to_csv(tmp_path / "data.csv", index=False)
    done = here("check", str(tmp_path / "data.csv"), "--range", "0.105:0.405", "--json")
    assert json.loads(done.stdout)["screening"]["segments"]["outside the range"] == 71
    refused = here("check", str(tmp_path / "data.csv"), "--range", "2:1")
    assert refused.returncode == 2 and "--range" in refused.stderr


def test_of_an_angle_the_range_is_in_radians(here):
    degrees = np.linspace(0.0, 20.0, 41)
    table = {"angle_deg": degrees, "torque_Nm": 0.5 * degrees}
    case = hdcal.read_case(table, range="0.05:0.2")
    inside = np.radians(degrees)
    inside = inside[(inside >= 0.05) & (inside <= 0.2)]
    np.testing.assert_allclose(case.records.deformation, inside, rtol=1e-12)
    with pytest.raises(InputError, match=r"rad.*ranges from 0 to 0.3491 rad"):
        hdcal.read_case(table, range="3:12")
    assert "angle [rad]" in " ".join(here("check", "--help").stdout.split())
