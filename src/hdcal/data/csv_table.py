"""From text to a table: separator, headers, and the cells of the readings."""

import csv
import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.blanks import tabbed
from hdcal.data.blocks import Blocks, block_notes, find_blocks, with_runs
from hdcal.data.findings import FileFindings
from hdcal.data.label_columns import label_columns
from hdcal.data.labview import with_whole_lines
from hdcal.data.line_cells import filled_cells, misfit
from hdcal.data.table_start import (
    TableStart,
    find_start,
    header_cells,
    is_number,
    split_line,
)
from hdcal.data.unit_row import other_units, with_unit
from hdcal.errors import quoted

# The nearest double, not a fast approximation of it: the same file must give the
# same posterior everywhere. From 3.1 on pandas does so unasked, and warns if asked.
_OLD = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _OLD else {}
_HEADLESS = (
    "Begin with a header row such as deformation_mm,force_N, or say which column is "
    "which, as in `columns` 'force=2[kN]'"
)
# Where the table begins is sought in as much of the file.
_HEAD = 1 << 18
# Pandas takes "+1E 2" for 100.
_TORN = re.compile(rb"\+[0-9.,]+[eE]\s")


@dataclass(frozen=True)
class CsvTable:
    """A table as a file holds it, without the lines that do not fit its headers.

    Attributes:
        headers: stripped, in the order of the file.
        header_row: line of the headers, 1 = first line of the file.
        rows: line number of each row, shape (n,).
        separator: comma, semicolon or tab.
        body: the rows, UTF-8, each ended by a newline.
        filled: number of lines with any cell in them, whether they fit or not.
        skipped: number of empty lines between the rows.
        notes: what was taken for titles and units.
    """

    headers: tuple[str, ...]
    header_row: int
    rows: np.ndarray
    separator: str
    body: bytes
    filled: int
    skipped: int
    notes: tuple[str, ...] = ()

    def take(self, kept: np.ndarray) -> "CsvTable":
        """Return some of the rows; those are true in the mask, shape (n,)."""
        lines = compress(self.body.split(b"\n"), kept)
        filled = self.filled - int(np.sum(~kept))
        body = b"\n".join([*lines, b""])
        return replace(self, rows=self.rows[kept], body=body, filled=filled)

    def texts(self, columns: Iterable[int]) -> dict[int, list[str]]:
        """Cells of some columns as text without blanks around it, by position."""
        read = self._read(columns, "str")
        return {place: [cell.strip() for cell in read[place]] for place in read}

    def numbers(self, columns: Iterable[int]) -> dict[int, np.ndarray]:
        """Those of some columns that hold plain numbers throughout, by position."""
        if _TORN.search(self.body):
            return {}
        try:
            read = self._read(columns, "float64")
        except ValueError:
            return {}
        arrays = {place: read[place].to_numpy() for place in read}
        return {n: array for n, array in arrays.items() if np.isfinite(array).all()}

    def _read(self, columns: Iterable[int], kind: str) -> dict[int, Any]:
        wanted = list(columns)
        if not self.body or not wanted:
            return dict.fromkeys(wanted, pd.Series([], dtype=kind))
        read = pd.read_csv(
            io.BytesIO(self.body),
            sep=self.separator,
            header=None,
            names=list(range(len(self.headers))),
            index_col=False,
            usecols=wanted,
            dtype=kind,
            decimal="," if self.separator != "," and b"," in self.body else ".",
            engine="c",
            **_EXACT,
            skipinitialspace=True,
            skip_blank_lines=False,
            na_filter=False,
            low_memory=False,
            quoting=csv.QUOTE_MINIMAL if b'"' in self.body else csv.QUOTE_NONE,
        )
        return {place: read[place] for place in wanted}


def split_table(
    utf8: bytes,
    findings: FileFindings,
    *,
    numbered: bool = False,
    labelled: bool = False,
) -> CsvTable:
    """Split a text into headers and lines with the right number of cells.

    Args:
        utf8: text with plain newlines.
        findings: of the file; gets one for each line that does not fit.
        numbered: columns are named by their numbers, so that no headers are needed.
        labelled: somebody said which column holds the runs.

    Returns:
        The table without the lines that do not fit.

    Raises:
        InputError: nothing in the file, or no header row.
    """
    if not utf8.strip():
        remedy = "Write a header row and at least 5 rows of readings"
        findings.refuse("the file is empty", remedy)
    begin, utf8, spaced = _begin(with_whole_lines(utf8, findings))
    lines = utf8.split(b"\n")
    begin, separator, headers = _columns(begin, lines, findings, numbered=numbered)
    top = begin.readings if begin.headers is None else begin.headers
    above = sum(bool(line.strip()) for line in lines[:top])
    units = None if begin.units is None else lines[begin.units]
    head = b"" if begin.headers is None else lines[top]
    lines = lines[begin.readings :] or [b""]
    blocks = find_blocks(utf8, lines, head, units, separator, len(headers))
    filled, cells = filled_cells(lines, separator)
    filled &= ~blocks.extra
    fits = filled & (cells == len(headers))
    rows = np.arange(len(lines)) + begin.readings + 1
    findings.add_rows(
        (int(rows[index]), *misfit(int(cells[index]), len(headers), separator))
        for index in np.flatnonzero(filled & ~fits)
    )
    used = int(np.flatnonzero(filled)[-1]) + 1 if filled.any() else 0
    table = CsvTable(
        headers=headers,
        header_row=top + 1,
        rows=rows[fits],
        separator=separator,
        body=b"\n".join([*compress(lines, fits), b""]),
        filled=int(filled.sum()),
        skipped=int((~filled & ~blocks.extra)[:used].sum()),
        notes=(*_notes(begin, above, headers, findings, spaced=spaced),),
    )
    return _with_runs(table, blocks, fits, labelled=labelled)


def _columns(
    begin: TableStart, lines: list[bytes], findings: FileFindings, *, numbered: bool
) -> tuple[TableStart, str, tuple[str, ...]]:
    """Return where the table begins, its separator, and its headers with their units.

    Numbers are no headers: where columns go by their numbers these stand for them.
    """
    top = begin.readings if begin.headers is None else begin.headers
    separator, headers = _headers(lines[top].decode(), findings, top + 1)
    if begin.headers is None or all(map(is_number, headers)):
        if not numbered:
            words = "the first row holds numbers where the headers should be"
            findings.refuse(words, _HEADLESS, top + 1)
        begin = TableStart(None, None, top, begin.torn)
        headers = tuple(str(number + 1) for number in range(len(headers)))
    for row in begin.torn:
        cells = len(split_line(lines[row].decode(), separator))
        words, remedy = misfit(cells, len(headers), separator)
        findings.add_rows([(row + 1, words, f"{remedy}, or remove the line")])
    if begin.units is not None:
        units = split_line(lines[begin.units].decode(), separator)
        findings.add_rows(other_units(headers, units, begin.units + 1))
        headers = tuple(map(with_unit, headers, units))
    return begin, separator, headers


def _runs(blocks: Blocks, fits: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the run of each row that fits, from 1, and how many runs there are."""
    runs = blocks.block[fits]
    if blocks.block[-1] == 1:
        return runs, 1
    # Headers twice, one below the other, begin no run.
    runs = np.unique(runs, return_inverse=True)[1] + 1
    return runs, int(runs.max(initial=1))


def _with_runs(
    table: CsvTable, blocks: Blocks, fits: np.ndarray, *, labelled: bool
) -> CsvTable:
    """Return a table whose blocks are runs, unless one of its columns names these."""
    runs, many = _runs(blocks, fits)
    own = any(header.lower() == "run" for header in table.headers)
    if many > 1 and (labelled or own or label_columns(table, "run")):
        many = 0
    table = replace(table, notes=(*table.notes, *block_notes(blocks, many)))
    if many < 2:
        return table
    lines = with_runs(table.body.split(b"\n")[:-1], runs, table.separator)
    headers = (*table.headers, "run")
    return replace(table, headers=headers, body=b"\n".join([*lines, b""]))


def _begin(utf8: bytes) -> tuple[TableStart, bytes, bool]:
    """Return where the table begins: below its first line, unless readings tell.

    With it the text, tabs between its columns, and whether those were blanks before.
    """
    head = utf8[:_HEAD].decode(errors="ignore")
    text = tabbed(utf8, head)
    if text is not None:
        utf8, head = text, text[:_HEAD].decode(errors="ignore")
    first = len(utf8) - len(utf8.lstrip(b"\n"))
    start = find_start(head) or TableStart(first, None, first + 1)
    return start, utf8, text is not None


def _notes(
    begin: TableStart,
    above: int,
    headers: tuple[str, ...],
    findings: FileFindings,
    *,
    spaced: bool,
) -> Iterator[str]:
    if spaced:
        yield "the columns are separated by blanks"
    if above:
        lines = "1 line" if above == 1 else f"{above} lines"
        names = ", ".join(map(quoted, headers))
        yield f"{lines} above the table taken for titles. Its columns: {names}"
    if begin.units is not None:
        row = findings.row_of_file(begin.units + 1)
        yield f"row {row} taken for the units of the columns"


def _headers(
    line: str, findings: FileFindings, row: int
) -> tuple[str, tuple[str, ...]]:
    # a semicolon or a tab is never part of a number; a comma may be one
    separator = max(";\t", key=line.count)
    if separator not in line:
        separator = ","
    if line.count('"') % 2:
        findings.refuse("a quotation mark is not closed", "Close it", row)
    headers = tuple(header_cells(line, separator))
    return separator, headers
