"""From a workbook (.xlsx) to the text of one of its sheets."""

import datetime
import hashlib
import re
import zipfile
from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from hdcal.data.columns import LABELS
from hdcal.data.findings import FileFindings
from hdcal.data.table_start import find_start, is_number
from hdcal.errors import quoted

# What begins so is a ZIP archive, as workbooks are.
MARK = b"PK\x03\x04"
# Largest content of an archive, unpacked, and rows of a sheet that are looked at.
_LARGEST, _MOST_ROWS = 1 << 28, 1 << 20
_BROKEN = "is no workbook that can be read", "Save it as CSV"
# Rows in which a table of several begins.
_TOP = 300
_WHICH = "Say which with `sheet`; with a *, as in 'Probe*', each is a specimen"
# Rows with two numbers or more that make a sheet a table of readings.
_READINGS = 5
Rows = list[list[str]]
# Which may be a whole number with signs for thousands.
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")


def read_sheet(
    path: Path, findings: FileFindings, sheet: str | None
) -> tuple[bytes, str, str]:
    """Return a sheet as text, cells separated by tabs, as `read_text` does.

    Args:
        path: of the workbook.
        findings: of the file.
        sheet: its name; by default the only one that holds a table of readings. With an
            asterisk it stands for every such sheet, each of which is a specimen.

    Returns:
        The text as UTF-8, the hash of the file's own bytes, and which sheet was taken
        where there are several.

    Raises:
        InputError: it is no workbook, or it is not clear which sheet is meant.
    """
    tables = _sheets(path, findings)
    several = sheet is not None and "*" in sheet
    named = [
        name
        for name in tables
        if sheet in (None, name) or (several and fnmatchcase(name, sheet or ""))
    ]
    if not named:
        names = ", ".join(map(quoted, tables))
        words = f"has no `sheet` {quoted(sheet or '')}"
        findings.refuse(words, f"Name one of: {names}")
    exact = sheet is not None and not several
    likely = named if exact else [name for name in named if _is_table(tables[name])]
    if not likely or (len(likely) > 1 and not several):
        names = ", ".join(map(quoted, likely or named))
        words = "no sheet holds a table of readings"
        if likely:
            words = f"{len(likely)} sheets hold a table: {names}"
        findings.refuse(words, _WHICH)
    found = {name: _with_points(_same(tables[name])) for name in likely}
    rows = _specimens(found, findings) if several else found[likely[0]]
    text = "\n".join(map("\t".join, rows))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    names = ", ".join(map(quoted, likely))
    note = f"sheet {names} is meant. If not, name the sheet" * (len(tables) > 1)
    if several:
        note = f"each sheet is a specimen: {names}"
        left_out = ", ".join(quoted(name) for name in named if name not in likely)
        note += f"; left out, as too few readings: {left_out}" * bool(left_out)
    return text.encode() + b"\n", digest, "" if exact else note


def _specimens(sheets: dict[str, Rows], findings: FileFindings) -> Rows:
    """Return sheets of the same columns one below the other, with what each is called.

    Raises:
        InputError: their columns differ.
    """
    first, wanted = next(iter(sheets)), []
    joined: Rows = []
    places: list[tuple[str, int]] = []
    for name, rows in sheets.items():
        start = find_start("\n".join(map("\t".join, rows[:_TOP])))
        if start is None or start.headers is None:
            findings.refuse(f"sheet {quoted(name)} has no row of headers", _WHICH)
        lines = [at for at in (start.headers, start.units) if at is not None]
        above = [rows[at] for at in lines]
        if "specimen" in above[0]:
            words = f"sheet {quoted(name)} names specimens itself"
            findings.refuse(words, "Name that sheet alone")
        if not joined:
            wanted = above
            joined = [[*above[0], "specimen"], *([*row, ""] for row in above[1:])]
            places = [(name, at + 1) for at in lines]
        if above != wanted:
            words = f"sheets {quoted(first)} and {quoted(name)} have other columns"
            findings.refuse(words, _WHICH)
        filled = [at for at in range(start.readings, len(rows)) if any(rows[at])]
        # Headers again begin another run, as they do in a sheet alone.
        joined += [
            [*row, "specimen" if row == above[0] else name]
            for row in (rows[at] for at in filled)
        ]
        places += [(name, at + 1) for at in filled]
    findings.places = places
    return joined


def _with_points(rows: Rows) -> Rows:
    """Return a sheet with decimal points, where its commas can be nothing else.

    Cells that hold numbers have points, texts beside them may have commas. They are no
    thousands where one of them has no three digits behind it, or a zero before it, or
    where there are no points at all. Labels stay as they are.
    """
    start = find_start("\n".join(map("\t".join, rows[:_TOP])))
    headers = [] if start is None or start.headers is None else rows[start.headers]
    labels = {at for at, header in enumerate(headers) if header in LABELS}
    numbers = [
        cell
        for row in rows
        for at, cell in enumerate(row)
        if is_number(cell) and at not in labels
    ]
    commas = [cell for cell in numbers if "," in cell]
    if any("." in cell for cell in numbers) and all(map(_THOUSANDS.fullmatch, commas)):
        return rows
    return [
        [
            cell.replace(",", ".") if is_number(cell) and at not in labels else cell
            for at, cell in enumerate(row)
        ]
        for row in rows
    ]


def _sheets(path: Path, findings: FileFindings) -> dict[str, Rows]:
    """Return the cells of every sheet as text, by name."""
    try:
        import openpyxl
    except ImportError:
        remedy = "Save it as CSV, or install what reads it: pip install openpyxl"
        findings.refuse("is a workbook", remedy)
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    except (OSError, ValueError, zipfile.BadZipFile):
        findings.refuse(*_BROKEN)
    if size > _LARGEST:
        findings.refuse("is a workbook of more than 256 MiB", "Save it as CSV")
    try:
        # Opened here: openpyxl asks for an ending of the name else.
        with open(path, "rb") as stream:
            book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
            return {
                each.title: [
                    [_text(cell) for cell in row]
                    for row in each.iter_rows(max_row=_MOST_ROWS, values_only=True)
                ]
                for each in book.worksheets
            }
    except Exception:  # whatever a parser makes of a broken file
        findings.refuse(*_BROKEN)


def _text(cell: Any) -> str:
    """Return a cell as text: a number in full, no separators within words."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, datetime.datetime | datetime.date | datetime.time):
        return cell.isoformat()
    return " ".join(str(cell).split())


def _is_table(rows: Iterable[list[str]]) -> bool:
    """Tell whether enough rows hold two numbers or more."""
    found = 0
    for row in rows:
        found += sum(map(is_number, row)) >= 2
        if found >= _READINGS:
            return True
    return False


def _same(rows: Rows) -> Rows:
    """Return rows without the columns that are empty throughout."""
    width = max(map(len, rows), default=0)
    whole = [row + [""] * (width - len(row)) for row in rows]
    kept = [place for place in range(width) if any(row[place] for row in whole)]
    return [[row[place] for place in kept] for row in whole]
