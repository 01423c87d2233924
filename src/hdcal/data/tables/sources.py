"""Sources of tables: files of any kind, and tables in memory."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings, why_not_readable
from hdcal.data.tables.blocks import ReadTable, find_table
from hdcal.data.tables.cells import unit_in
from hdcal.data.tables.grid import Grid, memory_grid
from hdcal.data.tables.headers import parse_header
from hdcal.data.tables.headings import UNIT_LABELS
from hdcal.data.tables.parquet_files import PARQUET, parquet_grid
from hdcal.data.tables.text import LARGEST_FILE, decode, read_bytes, text_grid
from hdcal.data.tables.workbook import sheet_grid
from hdcal.data.units import find_unit
from hdcal.errors import quoted

IN_MEMORY = "DataFrame"  # what findings call a table in memory
_SHOWN = 50  # rows that show whether cells hold units
_WORKBOOK = b"PK\x03\x04"
# First bytes of files that are no text.
_KINDS = {
    _WORKBOOK: "a workbook",
    PARQUET: "a Parquet file",
    b"\xd0\xcf\x11\xe0": "an old workbook (.xls)",
    b"MATLAB 5.0": "a MATLAB file (.mat)",
    b"\x89HDF": "an HDF5 file",
}


def is_frame(data: Any) -> bool:
    """Tell whether this is a table in memory: a data frame, or arrays by name."""
    kinds = "to_csv", "to_pandas"
    return isinstance(data, Mapping) or any(hasattr(data, name) for name in kinds)


def read_source(
    data: Any,
    findings: FileFindings,
    encoding: str | None = None,
    sheet: str | None = None,
) -> tuple[ReadTable, str]:
    """Return the table of a file, a DataFrame or arrays by name, and its hash.

    Where several sheets of a workbook hold readings, that of the sheet: `part_sha256`.
    """
    if is_frame(data):
        grid, sha256 = memory_grid(data, findings)
        return table_of(grid, findings), sha256
    path = Path(data)
    if (why := why_not_readable(path, LARGEST_FILE)) is not None:
        findings.refuse(*why)
    try:
        return _file_table(path, findings, encoding, sheet)
    except FileNotFoundError:
        findings.refuse("does not exist", "Check the name and the folder")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        findings.refuse(f"cannot be read ({reason})", "Check name and permissions")


def text_of(path: Path, sheet: str | None = None) -> bytes:
    """Return the bytes of a text file as they are, of any other the table as text."""
    if not _kind(path):
        return path.read_bytes()
    with FileFindings(str(path)) as findings:
        table, _ = read_source(path, findings, sheet=sheet)
    columns: Any = dict(enumerate(map(table.grid.texts, range(table.grid.width))))
    headers = [*table.headers]
    if table.runs is not None and "run" not in headers:
        columns["run"] = (table.runs + 1).astype(str)
        headers.append("run")
    frame = pd.DataFrame(columns)
    shown = headers if table.named else False
    return frame.to_csv(sep="\t", index=False, header=shown).encode()


def _kind(path: Path) -> bytes:
    """Return the first bytes of a file that tell its kind; none of a text."""
    with open(path, "rb") as stream:
        begins = stream.read(max(map(len, _KINDS)))
    return next((mark for mark in _KINDS if begins.startswith(mark)), b"")


def _file_table(
    path: Path, findings: FileFindings, encoding: str | None, sheet: str | None
) -> tuple[ReadTable, str]:
    kind, notes, part = _kind(path), [], ""
    if kind and encoding is not None:
        words = f"is {_KINDS[kind]}, which has no text encoding"
        findings.refuse(words, "Leave out `encoding`")
    if kind != _WORKBOOK and sheet is not None:
        findings.refuse("is not a workbook and has no sheets", "Leave out `sheet`")
    if kind == _WORKBOOK:
        grid, notes, part = sheet_grid(path, findings, sheet)
    elif kind == PARQUET:
        grid = parquet_grid(path, findings)
    elif kind:
        findings.refuse(f"is {_KINDS[kind]}", "Save it as .xlsx or CSV")
    else:
        raw = read_bytes(path, findings, wide=encoding is not None)
        text, guessed = decode(raw, findings, encoding)
        if not text.strip():
            remedy = "Write a header row and at least 5 rows of readings"
            findings.refuse("the file is empty", remedy)
        grid, notes = text_grid(text)
        notes = [*guessed, *notes]
    table = table_of(grid, findings)
    sha256 = file_sha256(path)
    sha256 = part_sha256(sha256, part) if part else sha256
    return replace(table, notes=(*notes, *table.notes)), sha256


def file_sha256(path: Path | str) -> str:
    """Return the hash of a file."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def part_sha256(whole: str, name: str) -> str:
    """Return the hash of a named part, from that of the source of several parts."""
    return hashlib.sha256(f"{whole} {name}".encode()).hexdigest()


def table_of(grid: Grid, findings: FileFindings) -> ReadTable:
    """Return the table in a grid; headers have the units of cells or columns of units.

    A unit that changes from row to row, or differs from the header's, is a finding.
    """
    table = find_table(grid, findings)
    headers, notes = [*table.headers], [*table.notes]

    def refuse(name: str, units: Sequence[str]) -> None:
        words = " and ".join(map(quoted, units))
        problem = f"the unit of {quoted(name)} changes between rows: {words}"
        findings.add(problem, "Convert the readings to one unit", table.header_row)

    for place, name in enumerate(headers[:-1]):
        if headers[place + 1].strip().casefold() not in UNIT_LABELS:
            continue
        units = [*filter(None, table.grid.labels(place + 1)[1])]
        if len(units) == 1 and find_unit(units[0]):
            headers[place] = f"{name} [{units[0]}]"
            words = f"the unit of {quoted(name)} is in the column to its right"
            notes.append(f"{words}: {units[0]}")
        elif len(units) > 1 and any(map(find_unit, units)):
            refuse(name, units[:3])
    sample = table.grid.take(np.arange(len(table.rows)) < _SHOWN)
    for place, name in enumerate(headers):
        if sample.is_numeric(place) or not any(map(unit_in, sample.texts(place))):
            continue
        header = parse_header(name)
        known = header.unit.name if header.unit and header.quantity else ""
        units = [*dict.fromkeys(map(unit_in, table.grid.texts(place)))]
        units = [unit for unit in units if unit and find_unit(unit) != header.unit]
        if len(units) == 1 and not known:
            headers[place] = f"{name} [{units[0]}]"
        elif units and header.quantity:
            refuse(name, [known, *units[:3]] if known else units[:3])
    return replace(table, headers=tuple(headers), notes=tuple(notes))
