"""A table in memory is read as its file would be, to the last digit."""

import numpy as np
import pandas as pd
import pytest

import hdcal
from hdcal.errors import InputError

RNG = np.random.default_rng(3)
FRAME = pd.DataFrame(
    {
        "deformation_mm": np.linspace(0.0, 0.5, 9) + RNG.normal(0.0, 1e-9, 9),
        "Kraft [kN]": RNG.normal(0.05, 0.01, 9),
        "run": ["a"] * 5 + ["b"] * 4,
        "time_s": np.arange(9.0),
    }
)


@pytest.mark.parametrize("kind", ["frame", "arrays", "becomes one"])
def test_it_says_what_its_file_says(folder, kind):
    class Other:
        """Another library's table."""

        def to_pandas(self):
            return FRAME

    given = {"frame": FRAME, "arrays": dict(FRAME), "becomes one": Other()}[kind]
    FRAME.to_csv(folder / "log.csv", index=False)
    gear = folder / "gear.toml"
    found, read = (
        hdcal.read_case(given, gear),
        hdcal.read_case(folder / "log.csv", gear),
    )
    for name in ("deformation", "force", "time", "run", "sense"):
        np.testing.assert_array_equal(
            getattr(found.records, name), getattr(read.records, name)
        )
    np.testing.assert_array_equal(found.records.deformation, FRAME["deformation_mm"])
    assert found.run_labels == ("a", "b")
    assert found.name == "DataFrame"
    assert "'Kraft [kN]' is the force in kN" in found.notes[0]


def test_what_is_wrong_is_told_by_row_and_column(folder):
    wrong = FRAME.assign(**{"Kraft [kN]": [*FRAME["Kraft [kN]"][:-1], np.nan]})
    with pytest.raises(InputError) as caught:
        hdcal.read_case(wrong, folder / "gear.toml")
    (found,) = caught.value.findings
    assert (found.file, found.row, found.column) == ("DataFrame", 10, "Kraft [kN]")
    unequal = {"deformation_mm": np.zeros(6), "force_N": np.zeros(5)}
    with pytest.raises(InputError, match="is no table"):
        hdcal.read_case(unequal, folder / "gear.toml")
    with pytest.raises(InputError, match="no gear file says the sizes"):
        hdcal.read_case(FRAME, theory="ring")


def test_columns_that_are_only_counted_have_no_headers():
    """The names 0 and 1 are no reading."""
    counted = pd.DataFrame(FRAME[["deformation_mm", "Kraft [kN]"]].to_numpy())
    asked = {"deformation": "1[mm]", "force": "2[kN]"}
    found = hdcal.read_case(counted, columns=asked)
    np.testing.assert_array_equal(found.records.deformation, FRAME["deformation_mm"])
    with pytest.raises(InputError, match="numbers where the headers should be"):
        hdcal.read_case(counted)


def test_a_gear_may_be_stated_in_memory():
    sizes = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}
    found = hdcal.read_case(FRAME, {**sizes, "deformation": "diametral"})
    assert (found.gear.theory, found.gear.reading) == ("ring", "diametral")
    same = {"gear": sizes, "measurement": {"deformation": "diametral"}}
    assert hdcal.read_case(FRAME, same).gear == found.gear
    # Whatever comes first, and what was handed over stays as it is.
    late = {"deformation": "diametral", **sizes, "measurement": {}}
    assert hdcal.read_case(FRAME, late).gear.reading == "diametral"
    assert late["measurement"] == {}
    for wrong in ({"gear": "x", **sizes}, {"measurement": 3, **late, **same}):
        with pytest.raises(InputError):
            hdcal.read_case(FRAME, {**wrong, "deformation": "radial"})
    with pytest.raises(InputError, match="unknown key") as caught:
        hdcal.read_case(FRAME, {**sizes, "radius": 40.0})
    assert str(caught.value.findings[0]).startswith("gear, column 'gear.radius'")


def test_a_unit_against_its_header_is_told():
    table = FRAME.rename(columns={"deformation_mm": "disp_um", "Kraft [kN]": "F_kN"})
    case = hdcal.read_case(table)
    assert case.records.deformation.max() == FRAME["deformation_mm"].max() / 1000.0
    np.testing.assert_array_equal(
        case.records.force, hdcal.read_case(FRAME).records.force
    )
    case = hdcal.read_case(table, columns={"force": "F_kN[N]"})
    assert case.records.force.max() == FRAME["Kraft [kN]"].max()
    assert any("in N, as was stated, though it names kN" in n for n in case.notes)
