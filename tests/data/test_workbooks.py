"""A sheet of a workbook is read as a table; which one is asked where it is unclear."""

import zipfile
from hashlib import sha256

import numpy as np
import openpyxl
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

READINGS = [(0.1 * row, 0.02 * row + 0.0005) for row in range(7)]
DEFORMATION, FORCE = np.array(READINGS).T * [[1.0], [1000.0]]
HEAD = [("Weg", "Kraft"), ("mm", "kN")]


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


def test_a_testing_machines_workbook(tmp_path):
    """Parameters on one sheet; the curve on another, below a title, beside a gap."""
    curve = [
        ("Prüfling", 3),
        (None, None, None),
        *((None, *row) for row in [*HEAD, *READINGS]),
    ]
    parameters = [("Norm", "EN 10002"), ("Geschwindigkeit", 1.5)]
    case = read_case(book(tmp_path, Parameter=parameters, Kurve=curve))
    # A workbook holds sixteen digits.
    np.testing.assert_allclose(case.records.deformation, DEFORMATION, rtol=1e-14)
    np.testing.assert_allclose(case.records.force, FORCE)
    assert "sheet 'Kurve' is read" in case.notes[0]
    assert all(note.startswith("ASSUMED") for note in case.notes[:4])


def test_of_two_tables_one_has_to_be_named(folder):
    other = [(x, 2.0 * f) for x, f in READINGS]
    path = book(folder, first=[*HEAD, *READINGS], second=[*HEAD, *other])
    for asked, words in (
        ({}, "2 sheets contain a table: 'first', 'second'"),
        ({"sheet": "third"}, "no `sheet` 'third'"),
        ({"encoding": "cp1252"}, "no text encoding"),
    ):
        with pytest.raises(InputError, match=words):
            read_case(path, **asked)
    with pytest.raises(InputError, match="not a workbook"):
        read_case(folder, sheet="first")
    np.testing.assert_allclose(read_case(path, sheet="second").records.force, 2 * FORCE)


def test_what_is_no_workbook_of_readings_is_refused(tmp_path):
    with pytest.raises(InputError, match="no sheet contains 5 readings"):
        read_case(book(tmp_path, notes=[("nothing", "here")]))
    path = tmp_path / "other.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "not a workbook")
    with pytest.raises(InputError, match="not a readable workbook"):
        read_case(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in range(5):
            archive.writestr(f"xl/{part}.xml", b"0" * (1 << 26))
    with pytest.raises(InputError, match="more than 256 MiB"):
        read_case(path)


def test_texts_with_commas_beside_numbers_are_decimal(tmp_path):
    """As exports hold them after somebody typed a value again."""
    typed = [(f"{x:.4f}".replace(".", ","), f) for x, f in READINGS[:3]]
    path = book(tmp_path, **{"Probe 1": [*HEAD, *typed, *READINGS[3:]]})
    np.testing.assert_allclose(read_case(path).records.deformation, DEFORMATION)
    # Beside 0.5 a text of "1,234" may be a thousand: refused, not decided.
    for cell in ("broken", "1,234"):
        spoiled = [*READINGS[:3], (0.3, cell), *READINGS[4:]]
        path = book(tmp_path, **{"Probe 2": [("Probe 2",), (), *HEAD, *spoiled]})
        with pytest.raises(InputError, match=rf"sheet 'Probe 2', row 8.*{cell}"):
            read_case(path, sheet="Probe 2")


def test_each_part_of_a_source_has_its_hash(tmp_path):
    """Of one of several sheets or specimens that of the text HASH NAME."""

    def part(whole, name):
        return sha256(f"{whole} {name}".encode()).hexdigest()

    table = [*HEAD, *READINGS]
    path = book(tmp_path, first=table, second=table, notes=[("nothing", "here")])
    whole = sha256(path.read_bytes()).hexdigest()
    for name in ("first", "second"):
        assert read_case(path, sheet=name).data_sha256 == part(whole, name)
    path = book(tmp_path, first=table, notes=[("nothing", "here")])
    whole = sha256(path.read_bytes()).hexdigest()
    each = read_case(path), read_case(path, sheet="first")
    assert [case.data_sha256 for case in each] == [whole] * 2
    labels = np.repeat(["a", "b"], 7)
    arrays = {"deformation_mm": [*DEFORMATION] * 2, "force_N": [*FORCE] * 2}
    both = arrays | {"specimen": labels}
    whole = read_case(both).data_sha256
    for name in "ab":
        assert read_case(both, specimen=name).data_sha256 == part(whole, name)
    alone = {name: cells[:7] for name, cells in both.items()}
    whole = read_case(alone).data_sha256
    assert read_case(alone, specimen="a").data_sha256 == whole


@pytest.mark.parametrize("cell", ["#DIV/0!", "#N/A", True, False])
@pytest.mark.parametrize("place", [0, 1])
def test_errors_of_formulas_and_truths_are_no_numbers(tmp_path, cell, place):
    spoiled = [[*row] for row in READINGS]
    spoiled[3][place] = cell
    path = book(tmp_path, Kurve=[*HEAD, *spoiled])
    words = "formula error" if isinstance(cell, str) else cell
    with pytest.raises(InputError, match=f"row 6, .*'{words}' is not a number") as no:
        read_case(path)
    assert len(no.value.findings) == 1
