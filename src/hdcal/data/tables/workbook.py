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
from hdcal.errors import InputError, quoted

# Largest content of an archive, unpacked, and rows of a sheet that are looked at.
_LARGEST, _MOST_ROWS = 1 << 28, 1 << 20
_WHICH = "Say which with `sheet`; with a *, as in 'Probe*', each is a specimen"
# Rows with two numbers or more that make a sheet a table of readings.
_FEWEST = 5
Rows = list[tuple[Any, ...]]


def sheet_grid(
    path: Path, findings: FileFindings, sheet: str | None
) -> tuple[ArrayGrid, list[str]]:
    """Return a sheet, and notes on what was assumed.

    Raises:
        InputError: it is no workbook, or it is not clear which sheet is meant.
    """
    sheets = _sheets(path, findings, sheet)
    if sheet is not None:
        return _grid(sheets[sheet]), []
    likely = _tables(path, findings, sheets)
    if len(likely) > 1:
        words = f"{len(likely)} sheets hold a table: {_listed(likely)}"
        findings.refuse(words, _WHICH)
    note = f"sheet {quoted(likely[0])} is read. If another is meant, name it"
    return _grid(sheets[likely[0]]), [note] if len(sheets) > 1 else []


def sheets_like(
    path: Path, findings: FileFindings, pattern: str
) -> tuple[list[str], str]:
    """Return the sheets that hold a table, by a pattern of names, and a note.

    Raises:
        InputError: there is none.
    """
    sheets = _sheets(path, findings, None)
    named = {n: rows for n, rows in sheets.items() if fnmatchcase(n, pattern)}
    if not named:
        words = f"has no `sheet` {quoted(pattern)}"
        findings.refuse(words, f"Name one of: {_listed([*sheets])}")
    likely = _tables(path, findings, named)
    few = [name for name in named if name not in likely]
    left_out = f"; left out, as too few readings: {_listed(few)}" if few else ""
    return likely, f"each sheet is a specimen: {_listed(likely)}{left_out}"


def _listed(names: list[str]) -> str:
    return ", ".join(map(quoted, names))


def _tables(path: Path, findings: FileFindings, sheets: dict[str, Rows]) -> list[str]:
    """Return the sheets with enough rows of two numbers; there has to be one."""
    likely = [name for name, rows in sheets.items() if _is_table(rows)]
    if not likely:
        refuse_formulas(path, findings)
        remedy = f"Write at least {_FEWEST} rows of readings below headers"
        words = f"no sheet holds a table of readings: {_listed([*sheets])}"
        findings.refuse(words, remedy)
    return likely


def _is_table(rows: Rows) -> bool:
    numbers = (sum(is_number(stored_text(cell)) for cell in row) for row in rows)
    return sum(many >= 2 for many in numbers) >= _FEWEST


def _grid(rows: Rows) -> ArrayGrid:
    """Return the grid of a sheet, without the columns that are empty throughout."""
    cells = np.full((len(rows), max(map(len, rows), default=0)), "", object)
    for place, row in enumerate(rows):
        cells[place, : len(row)] = row
    filled = cells != ""
    cells = cells[:, filled.any(axis=0)]
    places = np.arange(len(rows)) + 1
    grid = ArrayGrid(places, cells.shape[1], [], [*cells.T])
    return grid.take(filled.any(axis=1))


def _sheets(path: Path, findings: FileFindings, only: str | None) -> dict[str, Rows]:
    """Return the cells of every sheet by name, or of one alone."""
    broken = "is no workbook that can be read"
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    except (OSError, ValueError, zipfile.BadZipFile):
        findings.refuse(broken, "Save it as CSV")
    if size > _LARGEST:
        findings.refuse("is a workbook of more than 256 MiB", "Save it as CSV")
    try:
        every = {each.title: each for each in _open(path, values=True).worksheets}
        if only is not None and only not in every:
            words = f"has no `sheet` {quoted(only)}"
            findings.refuse(words, f"Name one of: {_listed([*every])}")
        return {
            name: [
                tuple(map(_cell, row))
                for row in each.iter_rows(max_row=_MOST_ROWS, values_only=True)
            ]
            for name, each in every.items()
            if only in (None, name)
        }
    except InputError:
        raise
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
