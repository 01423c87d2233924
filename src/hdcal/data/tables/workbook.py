"""Grids of the sheets of a workbook (.xlsx)."""

import datetime
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.tables.grid import Grid, stored_text
from hdcal.errors import quoted

_LARGEST = 1 << 28  # largest content of an archive, unpacked
_FEWEST = 5  # rows with two numbers or more that make a sheet a table of readings


def sheet_grid(
    path: Path, findings: FileFindings, sheet: str | None
) -> tuple[Grid, list[str], str]:
    """Return a sheet, by default the only one with readings, and a note on that.

    The text is the sheet's name where several sheets hold readings, else empty.
    """
    sheets = _sheets(path, findings)
    names = ", ".join(map(quoted, sheets))
    if sheet is not None and sheet not in sheets:
        findings.refuse(f"has no `sheet` {quoted(sheet)}", f"Name one of: {names}")
    likely = [name for name, grid in sheets.items() if _is_table(grid)]
    if sheet is not None:
        return sheets[sheet], [], sheet if {*likely} - {sheet} else ""
    if not likely:
        words = f"no sheet contains {_FEWEST} readings or more: {names}"
        remedy = "Write them in rows below headers. Formulas "
        remedy += "are read only if a spreadsheet program has saved their values"
        findings.refuse(words, remedy)
    if len(likely) > 1:
        tables = ", ".join(map(quoted, likely))
        words = f"{len(likely)} sheets contain a table: {tables}"
        remedy = "Select one with `sheet`. To compare parts write all rows into one "
        remedy += "sheet with a column specimen, or each sheet into a file of a folder"
        findings.refuse(words, remedy)
    note = f"sheet {quoted(likely[0])} is read. Select another one with `sheet`"
    return sheets[likely[0]], [note] if len(sheets) > 1 else [], ""


def _is_table(grid: Grid) -> bool:
    numbers = (line.numbers for line in grid.lines())
    return sum(many >= 2 for many in numbers) >= _FEWEST


def _sheets(path: Path, findings: FileFindings) -> dict[str, Grid]:
    broken = "is not a readable workbook"
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    except (OSError, ValueError, zipfile.BadZipFile):
        findings.refuse(broken, "Save it as CSV")
    if size > _LARGEST:
        findings.refuse("is a workbook of more than 256 MiB", "Save it as CSV")
    try:
        how: Any = {"sheet_name": None, "header": None, "na_filter": False}
        frames = pd.read_excel(path, engine="openpyxl", dtype=object, **how)
    except ImportError:
        remedy = "Save it as CSV, or install openpyxl: pip install openpyxl"
        findings.refuse("is a workbook, which needs openpyxl", remedy)
    except Exception:  # whatever a parser makes of a broken file
        findings.refuse(broken, "Save it as CSV")
    return {str(name): _grid(frame) for name, frame in frames.items()}


def _grid(frame: pd.DataFrame) -> Grid:
    """Return the grid of a sheet, without its empty rows and columns."""
    cells = frame.map(_cell).to_numpy(object)
    filled = cells != ""
    rows, columns = filled.any(axis=1), filled.any(axis=0)
    return Grid(np.flatnonzero(rows) + 1, [*cells[rows][:, columns].T])


def _cell(cell: Any) -> Any:
    """Return a cell: a number as it is stored, anything else as text."""
    if isinstance(cell, datetime.datetime | datetime.date | datetime.time):
        return cell.isoformat()
    if cell != cell:  # pandas' reading of #DIV/0! and its like
        return "formula error"
    number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return cell if number else stored_text(cell)
