"""Exports of machines and loggers are read by name and unit; what is open is asked."""

import numpy as np
import openpyxl
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

STIFFNESS = 12.0
X = np.round(np.linspace(0.0, 1.1, 12), 3)
F = np.round(STIFFNESS * X + 0.3, 4)


def rows(*columns, separator=",", decimal=".") -> str:
    lines = (separator.join(map(str, cells)) for cells in zip(*columns, strict=True))
    text = "\n".join(lines) + "\n"
    return text if decimal == "." else text.replace(".", decimal)


def read(folder, text: str, **asked):
    (folder / "log.txt").write_text(text, "utf-8")
    return read_case(folder / "log.txt", **asked)


def check(case, x=X, force=F) -> None:
    np.testing.assert_allclose(case.records.deformation, x, atol=1e-12)
    np.testing.assert_allclose(case.records.force, force, rtol=1e-9)


def refused(folder, text: str, **asked) -> list[str]:
    with pytest.raises(InputError) as caught:
        read(folder, text, **asked)
    return [str(finding) for finding in caught.value.findings]


def test_units_in_columns_behind_the_numbers(tmp_path):
    text = "Maximum,9.1,@\nNo.,Force,Unit,Displacement,Unit,Judge,\n"
    newtons, microns, judged = (np.full(12, one) for one in ("cN", "um", "OK"))
    cells = range(12), F, newtons, 1e3 * X, microns, judged, [""] * 12
    check(read(tmp_path, text + rows(*cells)), force=F / 100)
    text = "Force,Unit,Travel [mm]\n" + rows(F, ["N"] * 6 + ["kN"] * 6, X)
    assert any(
        "changes between rows: 'N' and 'kN'" in one for one in refused(tmp_path, text)
    )


def test_units_in_the_cells(tmp_path):
    cells = [f"{x} um" for x in 1e3 * X], [f"{f}cN" for f in F]
    check(read(tmp_path, "Travel,Load\n" + rows(*cells)), force=F / 100)
    text = "Travel [mm];Load\n" + rows(X, cells[1], separator=";", decimal=",")
    check(read(tmp_path, text), force=F / 100)
    mixed = [f"{f} {'N' if f < 5 else 'kN'}" for f in F]
    for header in ("Load", "Load [lbf]"):
        found = refused(tmp_path, f"Travel [mm],{header}\n" + rows(X, mixed))
        assert any("changes" in one and "'kN'" in one for one in found)


def test_rows_of_ranges_stand_between_names_and_readings(tmp_path):
    text = (
        'Logger,"A-1"\nRate (Hz),10\nName,"Extension","Load"\nRange,10,50\n'
        'Factor,5,10\nUnit,"mm","N"\n'
    )
    cells = rows(np.arange(12) / 10, X, F)
    check(read(tmp_path, text + cells))
    found = refused(tmp_path, text.replace('"mm","N"', '"V","V"') + cells)
    assert len(found) == 2 and all("calibration" in one for one in found)


def test_several_gauges_are_asked_about(tmp_path):
    text = "Zeit\tKraft Sollwert\tKraft\tWeg\t2011 C\t3390412\nsec\tN\tN\tmm\tmm\tmm\n"
    cells = rows(np.arange(12), F + 1, F, 8 * X, X, 2 * X, separator="\t", decimal=",")
    (found,) = refused(tmp_path, text + cells)
    for name in ("'Weg [mm]'", "'2011 C [mm]'", "'3390412 [mm]'", "4, 5, 6"):
        assert name in found
    check(read(tmp_path, text + cells, columns={"deformation": "5"}))
    text = "Displacement (mm),Compensated displacement (mm),Force (N)\n"
    (found,) = refused(tmp_path, text + rows(1.1 * X, X, F))
    assert "'deformation=1'" in found


@pytest.mark.parametrize("blank", [4, 9])
def test_of_a_slow_channel_whole_rows_are_read(tmp_path, blank):
    x, force = np.repeat(X, blank + 1), np.repeat(F, blank + 1)
    cells = [str(v) if i % (blank + 1) == 0 else "" for i, v in enumerate(x)]
    case = read(tmp_path, "force_N,deformation_mm\n" + rows(force, cells))
    check(case)
    (note,) = (note for note in case.notes if "is empty in" in note)
    assert f"{12 * blank} of {12 * (blank + 1)} rows" in note


def test_a_slow_channel_that_is_not_needed_is_left_out(tmp_path):
    warm = ["20.5" if i % 4 == 0 else "" for i in range(12)]
    case = read(tmp_path, "force_N,deformation_mm,temperature_C\n" + rows(F, X, warm))
    check(case)
    assert "temperature" not in case.records.known
    cells = [str(x) if i < 5 else "" for i, x in enumerate(X)]
    (found,) = refused(tmp_path, "force_N,deformation_mm\n" + rows(F, cells))
    assert "7 rows in total" in found


def test_blocks_have_headers_of_their_own(tmp_path):
    """The second one stands below a title with numbers."""
    text = "Run 1\nTime\tTravel\tLoad\ns\tmm\tN\n" + rows(
        np.arange(6), X[:6], F[:6], separator="\t"
    )
    second = "Time\tTravel\tLoad\ns\tmm\tN\n"
    second += rows(np.arange(6), X[6:], F[6:], separator="\t")
    text += f"\nRun 2\t8.0\ts\n{second}"
    case = read(tmp_path, text)
    check(case)
    assert case.records.run.tolist() == [0] * 6 + [1] * 6
    other = text.replace(
        "Time\tTravel\tLoad\ns\tmm\tN", "Time\tLoad\tTravel\ns\tN\tmm", 1
    )
    assert any("in the same order" in one for one in refused(tmp_path, other))


def test_a_block_of_other_columns_is_left_out_or_refused(tmp_path):
    text = "Travel [mm]\tLoad [N]\tTime [s]\n" + rows(X, F, range(12), separator="\t")
    few = text + "\nExtremes\nTravel [mm]\tLoad [N]\n0.1\t0.2\n1.1\t13.5\n"
    case = read(tmp_path, few)
    check(case)
    assert any("17, 18" in note for note in case.notes)
    many = text + "Travel [mm]\tGap [um]\n" + rows(X, F, separator="\t")
    assert any("Split the file" in one for one in refused(tmp_path, many))


def test_a_clock_that_is_reset_is_not_used(tmp_path):
    clock = [*range(9), 0, 1, 2]
    case = read(tmp_path, "Time [s],Travel [mm],Load [N]\n" + rows(clock, X, F))
    check(case)
    assert "time" not in case.records.known and len(case.run_labels) == 1
    text = "specimen,time_s,Travel [mm],Load [N]\n"
    (found,) = refused(tmp_path, text + rows(["A"] * 6 + ["B"] * 6, clock, X, F))
    assert "row 11" in found and "'B'" in found


@pytest.mark.parametrize(
    ("raw", "word"),
    [
        (b"<html><body><table><tr><td>1</td></tr></table></body></html>", "HTML"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), ".xls"),
        (b"MATLAB 5.0 MAT-file" + bytes(600), "MATLAB"),
        (b"\x89HDF\r\n" + bytes(600), "HDF5"),
    ],
)
def test_a_file_that_is_no_table_is_called_what_it_is(tmp_path, raw, word):
    (tmp_path / "data.xls").write_bytes(raw)
    with pytest.raises(InputError) as caught:
        read_case(tmp_path / "data.xls")
    (found,) = caught.value.findings
    assert word in found.problem and ".xlsx" in found.remedy


def test_formulas_without_values_are_called_so(tmp_path):
    book = openpyxl.Workbook()
    book.active.append(["deformation_mm", "other", "force_N"])
    for place, x in enumerate(X.tolist()):
        book.active.append([x, 1.0, f"=A{place + 2}*12"])
    book.save(tmp_path / "book.xlsx")
    with pytest.raises(InputError, match="'force_N' is empty"):
        read_case(tmp_path / "book.xlsx")


def test_a_mass_is_asked_about(tmp_path):
    (found,) = refused(tmp_path, "Travel (in),Load (lb)\n" + rows(X, F))
    assert "lbf" in found
    first, second = refused(tmp_path, "mass (kg),position (m)\n" + rows(F, X))
    assert "'deformation=2[m]'" in first and "'force=1[kgf]'" in second


def test_a_column_that_is_not_used_is_no_obstacle(tmp_path):
    other = ["1.5"] * 5 + ["OVL", "-", "nan", "1,5", "x", "", "1e999"]
    text = "deformation_mm;gauge;force_N\n" + rows(X, other, F, separator=";")
    check(read(tmp_path, text))
    volts = "Travel (in V),Force (in V),Travel (in mm),Force (in N)\n"
    check(read(tmp_path, volts + rows(X / 3, F / 50, X, F)))
