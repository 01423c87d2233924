"""Tables in memory and of Parquet are read to the last digit."""

import numpy as np
import pandas as pd
import pytest

import hdcal
from hdcal.data.measurements.folder import read_gear_folder
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
X, KN = (FRAME[name].to_numpy() for name in ("deformation_mm", "Kraft [kN]"))
SIZES = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}


class Other:
    """A table of another library."""

    def to_pandas(self):
        return FRAME


@pytest.mark.parametrize(
    "kind", ["csv", "frame", "arrays", "other", "index", "parquet"]
)
def test_every_kind_of_table_is_the_same_case(tmp_path, kind):
    FRAME.to_csv(tmp_path / "log.csv", index=False)
    FRAME.assign(trace=[[1.0]] * 9).to_parquet(tmp_path / "log.parquet")
    kinds = {"csv": tmp_path / "log.csv", "parquet": tmp_path / "log.parquet"}
    kinds |= {"frame": FRAME, "arrays": dict(FRAME), "other": Other()}
    kinds |= {"index": FRAME.set_index(["run", "time_s"])}
    case = hdcal.read_case(kinds[kind])
    np.testing.assert_array_equal(case.records.deformation, X)
    np.testing.assert_array_equal(case.records.force, 1000.0 * KN)
    np.testing.assert_array_equal(case.records.time, FRAME["time_s"])
    assert case.run_labels == ("a", "b")
    assert (case.gear.theory, case.gear.name) == ("spring", "part")
    assert any("'Kraft [kN]' is the force in kN" in note for note in case.notes)
    again = hdcal.read_case(case.to_frame())
    np.testing.assert_array_equal(again.records.force, case.records.force)


@pytest.mark.parametrize("cell", [np.nan, False])
def test_a_finding_names_row_and_column(folder, cell):
    wrong = FRAME.assign(**{"Kraft [kN]": [*KN[:-1].tolist(), cell]})
    with pytest.raises(InputError) as caught:
        hdcal.read_case(wrong, folder / "gear.toml")
    (found,) = caught.value.findings
    assert (found.file, found.row, found.column) == ("DataFrame", 10, "Kraft [kN]")
    for data, words in (
        ({"deformation_mm": np.zeros(6), "force_N": np.zeros(5)}, "is not a table"),
        (pd.concat({"rig": FRAME}, axis=1), "columns of several levels"),
        (3, "is a int"),
    ):
        with pytest.raises(InputError, match=words):
            hdcal.read_case(data)


def test_columns_that_are_only_counted_have_no_headers():
    """The names 0 and 1 are no reading."""
    counted = pd.DataFrame(np.stack([X, KN], axis=1))
    asked = {"deformation": "1[mm]", "force": "2[kN]"}
    case = hdcal.read_case(counted, columns=asked)
    np.testing.assert_array_equal(case.records.deformation, X)
    with pytest.raises(InputError, match="row contains numbers"):
        hdcal.read_case(counted)


def test_a_broken_file_is_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"PAR1" + bytes(range(256)) * 4)
    with pytest.raises(InputError, match="is not a readable Parquet file"):
        hdcal.read_case(tmp_path / "a")


def test_a_gear_may_be_stated_in_memory():
    case = hdcal.read_case(FRAME, {**SIZES, "deformation": "diametral"})
    assert (case.gear.theory, case.gear.reading) == ("ring", "diametral")
    same = {"gear": SIZES, "measurement": {"deformation": "diametral"}}
    assert hdcal.read_case(FRAME, same).gear == case.gear
    # Whatever comes first, and the mapping that was given stays as it is.
    late = {"deformation": "diametral", **SIZES, "measurement": {}}
    assert hdcal.read_case(FRAME, late).gear.reading == "diametral"
    assert late["measurement"] == {}
    for wrong, words in (
        ({"gear": "x", **SIZES}, "gear"),
        ({**same, "deformation": "radial"}, "stated twice"),
        ({**SIZES, 1: 2}, "'gear.1': unknown key"),
        ({"gear": {**SIZES, None: 2}}, "'gear.None': unknown key"),
        ({**same, "priors": {5: 1.0}}, "'priors.5': unknown"),
    ):
        with pytest.raises(InputError, match=words):
            hdcal.read_case(FRAME, wrong)


def test_a_unit_against_its_header_has_a_note():
    table = FRAME.rename(columns={"deformation_mm": "disp_um", "Kraft [kN]": "F_kN"})
    case = hdcal.read_case(table)
    assert case.records.deformation.max() == X.max() / 1000.0
    np.testing.assert_array_equal(case.records.force, 1000.0 * KN)
    case = hdcal.read_case(table, columns={"force": "F_kN[N]"})
    assert case.records.force.max() == KN.max()
    assert any("although its header states kN" in note for note in case.notes)


def test_without_a_gear_file_the_stiffness_is_that_of_the_readings(tmp_path):
    """At their mean temperature, not at one that nobody measured at."""
    warm = np.linspace(58.04, 62.04, 9)
    case = hdcal.read_case(FRAME.assign(temperature_C=warm))
    assert case.gear.reference_temperature == 60.0
    words = "at the mean temperature of the readings, 60 °C"
    assert sum(words in note for note in case.notes) == 1
    for table, gear, there in (
        (FRAME, None, 20.0),
        (FRAME.assign(temperature_C=warm), SIZES, 20.0),
        (FRAME.assign(temperature_C=warm), {"theory": "spring"}, 20.0),
    ):
        case = hdcal.read_case(table, gear)
        assert case.gear.reference_temperature == there
        assert not any("mean temperature" in note for note in case.notes)
    # Of a folder of gears as well; a file that states none counts as the others.
    for name, each in (("a", 50.0), ("b", 60.0), ("c", None)):
        warmth = {} if each is None else {"temperature_C": each}
        FRAME.assign(**warmth).to_csv(tmp_path / f"{name}.csv", index=False)
    case, _ = read_gear_folder(tmp_path)
    assert case.gear.reference_temperature == 55.0
    np.testing.assert_array_equal(case.records.temperature[-9:], 55.0)


@pytest.mark.parametrize(
    ("header", "cells", "words"),
    [
        ("Temperatur", [20.0] * 9, "temperature, is not used, as it has no unit"),
        ("Versuch", [*"abcdefghi"], "run, is not used, as it differs from row to row"),
    ],
)
def test_a_likely_column_that_is_not_used_is_named(header, cells, words):
    case = hdcal.read_case(FRAME.drop(columns="run").assign(**{header: cells}))
    start = f"ASSUMED: '{header}', which may be the {words}. Name the column"
    assert sum(note.startswith(start) for note in case.notes) == 1
    assert f"columns not used: '{header}'" in case.notes
