"""From a workbook (.xlsx) to the text of one of its sheets."""

import datetime
import hashlib
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hdcal.data.findings import FileFindings
from hdcal.data.table_start import is_number
from hdcal.errors import quoted

# What begins so is a ZIP archive, as workbooks are.
MARK = b"PK\x03\x04"
# Largest content of an archive, unpacked, and rows of a sheet that are looked at.
_LARGEST, _MOST_ROWS = 1 << 28, 1 << 20
_BROKEN = "is no workbook that can be read", "Save it as CSV"
# Rows with two numbers or more that make a sheet a table of readings.
_READINGS = 5


def read_sheet(
    path: Path, findings: FileFindings, sheet: str | None
) -> tuple[bytes, str, str]:
    """Return a sheet as text, cells separated by tabs, as `read_text` does.

    Args:
        path: of the workbook.
        findings: of the file.
        sheet: its name; by default the only one that holds a table of readings.

    Returns:
        The text as UTF-8, the hash of the file's own bytes, and which sheet was taken
        where there are several.

    Raises:
        InputError: it is no workbook, or it is not clear which sheet is meant.
    """
    tables = _sheets(path, findings)
    if sheet is not None and sheet not in tables:
        names = ", ".join(map(quoted, tables))
        findings.refuse(f"has no `sheet` {quoted(sheet)}", f"Name one of: {names}")
    likely = [sheet] if sheet else [n for n, t in tables.items() if _is_table(t)]
    if len(likely) != 1:
        names = ", ".join(map(quoted, likely or tables))
        words = "no sheet holds a table of readings"
        if likely:
            words = f"{len(likely)} sheets hold a table: {names}"
        findings.refuse(words, "Say which with `sheet`")
    text = "\n".join(map("\t".join, _same(tables[likely[0]])))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    told = len(tables) > 1 and sheet is None
    note = f"sheet {quoted(likely[0])} is meant. If not, name the sheet" * told
    return text.encode() + b"\n", digest, note


def _sheets(path: Path, findings: FileFindings) -> dict[str, list[list[str]]]:
    """Return the cells of every sheet as text, by name."""
    try:
        import openpyxl
    except ImportError:
        remedy = "Save it as CSV, or install what reads it: hdcal[files]"
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


def _same(rows: list[list[str]]) -> list[list[str]]:
    """Return rows without the columns that are empty throughout."""
    width = max(map(len, rows), default=0)
    whole = [row + [""] * (width - len(row)) for row in rows]
    kept = [place for place in range(width) if any(row[place] for row in whole)]
    return [[row[place] for place in kept] for row in whole]
