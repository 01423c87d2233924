"""A sheet of a workbook is read as a table; which one is asked where it is unclear."""

import zipfile

import numpy as np
import openpyxl
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

READINGS = [(0.1 * row, 0.02 * row + 0.0005) for row in range(7)]


def book(folder, **sheets):
    """Write a workbook of these sheets, rows of cells each, and return its path."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets.items():
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    path = folder / "book.xlsx"
    made.save(path)
    return path


def read(path, folder, **asked):
    return read_case(path, folder / "gear.toml", **asked)


def test_a_testing_machines_workbook(folder):
    """Parameters on one sheet; the curve on another, below a title, beside a gap."""
    curve = [
        ("Prüfling", 3),
        (None, None, None),
        (None, "Weg", "Kraft"),
        (None, "mm", "kN"),
        *((None, *row) for row in READINGS),
    ]
    parameters = [("Norm", "EN 10002"), ("Geschwindigkeit", 1.5)]
    path = book(folder, Parameter=parameters, Kurve=curve)
    case = read(path, folder)
    deformation, force = np.array(READINGS).T
    # A workbook holds sixteen digits.
    np.testing.assert_allclose(case.records.deformation, deformation, rtol=1e-14)
    np.testing.assert_allclose(case.records.force, 1000.0 * force)
    assert "sheet 'Kurve' is meant" in case.notes[0]
    assert all(note.startswith("ASSUMED") for note in case.notes[:4])


def test_of_two_tables_one_has_to_be_named(folder):
    head = ("deformation_mm", "force_kN")
    other = [(x, 2.0 * f) for x, f in READINGS]
    path = book(folder, first=[head, *READINGS], second=[head, *other])
    with pytest.raises(InputError, match="2 sheets hold a table: 'first', 'second'"):
        read(path, folder)
    case = read(path, folder, sheet="second")
    assert case.records.force[-1] == pytest.approx(2000.0 * READINGS[-1][1])
    with pytest.raises(InputError, match="no `sheet` 'third'"):
        read(path, folder, sheet="third")


def test_a_workbook_without_readings_is_refused(folder):
    path = book(folder, notes=[("nothing", "here")])
    with pytest.raises(InputError, match="no sheet holds a table"):
        read(path, folder)


def test_an_archive_of_something_else_is_refused(folder):
    path = folder / "other.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "no workbook")
    with pytest.raises(InputError, match="no workbook that can be read"):
        read(path, folder)


def test_what_unpacks_to_too_much_is_refused_before_it_is_read(folder):
    path = folder / "bomb.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in range(5):
            archive.writestr(f"xl/{part}.xml", b"0" * (1 << 26))
    with pytest.raises(InputError, match="more than 256 MiB"):
        read(path, folder)


HEAD = [("Weg", "Kraft"), ("mm", "kN")]


def test_sheets_of_one_kind_are_specimens(folder):
    """The second holds its numbers as texts with commas, below a title."""
    other = [(f"{x:.3f}".replace(".", ","), f"{2 * f:.4f}") for x, f in READINGS]
    other = [(x, f.replace(".", ",")) for x, f in other]
    sheets = {
        "Protokoll": [("Prüfer", "M. Weber")],
        "Probe 1": [*HEAD, *READINGS],
        "Probe 2": [("Probe 2",), (), *HEAD, *other],
    }
    path = book(folder, **sheets)
    with pytest.raises(InputError, match=r"with a \*, as in 'Probe\*'"):
        read(path, folder)
    case = read(path, folder, sheet="Probe*")
    deformation, force = np.array(READINGS).T
    np.testing.assert_allclose(case.records.deformation, np.tile(deformation, 2))
    wanted = np.append(1000.0 * force, 2000.0 * force)
    np.testing.assert_allclose(case.records.force, wanted, atol=0.051)
    assert case.specimen_labels == ("Probe 1", "Probe 2")
    assert np.array_equal(case.records.specimen, np.repeat([0, 1], len(READINGS)))
    assert any("each sheet is a specimen" in note for note in case.notes)
    assert case.name == "book-Probe"


def test_of_joined_sheets_a_finding_names_sheet_and_row(folder):
    spoiled = [*READINGS[:3], (0.3, "broken"), *READINGS[4:]]
    titled = [("Probe 2",), (), *HEAD, *spoiled]
    path = book(folder, **{"Probe 1": [*HEAD, *READINGS], "Probe 2": titled})
    with pytest.raises(InputError, match=r"sheet 'Probe 2', row 8.*broken"):
        read(path, folder, sheet="Probe*")


def test_only_a_sheet_of_commas_alone_gets_points(folder):
    """Beside 0.5 a text of "1,234" may be a thousand: that is told, not decided."""
    head = [("deformation_mm", "force_N")]
    mixed = [(x, f"1,{234 + row}") for row, (x, _) in enumerate(READINGS)]
    path = book(folder, **{"Probe 1": [*head, *READINGS], "Probe 2": [*head, *mixed]})
    with pytest.raises(InputError, match="1,234"):
        read(path, folder, sheet="Probe*")


def test_texts_with_commas_beside_numbers_are_decimal_where_they_can_be_no_other(
    folder,
):
    """As test machines' exports hold them after somebody typed a value again."""
    typed = [(f"{x:.4f}".replace(".", ","), f) for x, f in READINGS[:3]]
    path = book(folder, **{"Probe 1": [*HEAD, *typed, *READINGS[3:]]})
    for sheet in ("Probe 1", "Probe*", None):
        case = read(path, folder, sheet=sheet)
        np.testing.assert_allclose(case.records.deformation, np.array(READINGS)[:, 0])
