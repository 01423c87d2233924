"""Grids of the sheets of a workbook (.xlsx)."""

import datetime
import io
import zipfile
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.cells import is_number
from hdcal.data.tables.grid import ArrayGrid, stored_text
from hdcal.errors import quoted

# Largest content of an archive, unpacked, and rows of a sheet that are looked at.
_LARGEST, _MOST_ROWS = 1 << 28, 1 << 20
_WHICH = "Say which with `sheet`; with a *, as in 'Probe*', each is a specimen"
# Rows with two numbers or more that make a sheet a table of readings.
_FEWEST = 5
Rows = list[tuple[Any, ...]]


def sheet_grids(
    path: Path, findings: FileFindings, sheet: str | None
) -> tuple[dict[str, ArrayGrid], list[str]]:
    """Return the sheets that are meant, by name, and notes on what was assumed.

    Args:
        path: of the workbook.
        findings: of the file.
        sheet: its name; by default the only one that holds a table of readings. With an
            asterisk it stands for every such sheet.

    Raises:
        InputError: it is no workbook, or it is not clear which sheet is meant.
    """
    sheets = _sheets(path, findings)
    several = sheet is not None and "*" in sheet
    exact = sheet is not None and not several
    # A name may hold an asterisk itself.
    pattern = "*" if sheet is None else sheet
    named = [n for n in sheets if n == sheet or (not exact and fnmatchcase(n, pattern))]

    def names(some: list[str]) -> str:
        return ", ".join(map(quoted, some))

    if not named:
        words = f"has no `sheet` {quoted(sheet or '')}"
        findings.refuse(words, f"Name one of: {names([*sheets])}")
    likely = named if exact else [name for name in named if _is_table(sheets[name])]
    if not likely:
        refuse_formulas(path, findings)
        remedy = f"Write at least {_FEWEST} rows of readings below headers"
        findings.refuse(f"no sheet holds a table of readings: {names(named)}", remedy)
    if len(likely) > 1 and not several:
        findings.refuse(f"{len(likely)} sheets hold a table: {names(likely)}", _WHICH)
    notes = []
    if several:
        few = [name for name in named if name not in likely]
        left_out = f"; left out, as too few readings: {names(few)}" if few else ""
        notes = [f"each sheet is a specimen: {names(likely)}{left_out}"]
    elif len(sheets) > 1 and not exact:
        notes = [f"sheet {quoted(likely[0])} is meant. If not, name the sheet"]
    return {name: _grid(sheets[name]) for name in likely}, notes


def _grid(rows: Rows) -> ArrayGrid:
    """Return the grid of a sheet, without the columns that are empty throughout."""
    cells = np.full((len(rows), max(map(len, rows), default=0)), "", object)
    for place, row in enumerate(rows):
        cells[place, : len(row)] = row
    filled = cells != ""
    cells = cells[:, filled.any(axis=0)]
    places = np.arange(len(rows)) + 1
    grid = ArrayGrid(places, cells.shape[1], [], lambda place: cells[:, place])
    return grid.take(filled.any(axis=1))


def _sheets(path: Path, findings: FileFindings) -> dict[str, Rows]:
    """Return the cells of every sheet, by name."""
    broken = "is no workbook that can be read"
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    except (OSError, ValueError, zipfile.BadZipFile):
        findings.refuse(broken, "Save it as CSV")
    if size > _LARGEST:
        findings.refuse("is a workbook of more than 256 MiB", "Save it as CSV")
    try:
        return {
            each.title: [
                tuple(map(_cell, row))
                for row in each.iter_rows(max_row=_MOST_ROWS, values_only=True)
            ]
            for each in _open(path, values=True).worksheets
        }
    except ImportError:
        remedy = "Save it as CSV, or install what reads it: pip install openpyxl"
        findings.refuse("is a workbook", remedy)
    except Exception:  # whatever a parser makes of a broken file
        findings.refuse(broken, "Save it as CSV")


def _open(path: Path, *, values: bool) -> Any:
    """Return an open workbook, its formulas or their values."""
    import openpyxl

    # Given as bytes, as openpyxl else requires an ending of the name.
    raw = io.BytesIO(path.read_bytes())
    return openpyxl.load_workbook(raw, read_only=True, data_only=values)


def refuse_formulas(path: Path, findings: FileFindings) -> None:
    """Refuse a workbook of formulas that no program has computed."""
    for sheet in _open(path, values=False).worksheets:
        rows = sheet.iter_rows(max_row=100)
        cells = [c for row in rows for c in row if str(c.value).startswith("=")]
        if len(cells) >= _FEWEST:
            name, first = quoted(sheet.title), cells[0].coordinate
            words = f"sheet {name} holds formulas without values, as in {first}"
            remedy = "Open it in a spreadsheet program and save it again"
            findings.refuse(words, remedy)


def _cell(cell: Any) -> Any:
    """Return a cell: a number as it is stored, anything else as text."""
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return cell
    if isinstance(cell, datetime.datetime | datetime.date | datetime.time):
        return cell.isoformat()
    return "" if cell is None else " ".join(str(cell).split())


def _is_table(rows: Rows) -> bool:
    """Tell whether enough rows hold two numbers or more."""
    count = 0
    for row in rows:
        count += sum(is_number(stored_text(cell)) for cell in row) >= 2
        if count >= _FEWEST:
            return True
    return False
