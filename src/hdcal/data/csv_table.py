"""From text to a table: separator, headers, and the cells of the readings."""

import csv
import io
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings

_NAMES = {",": "comma", ";": "semicolon", "\t": "tab"}

# The nearest double, not a fast approximation of it: the same file must give the
# same posterior everywhere. From 3.1 on pandas does so unasked, and warns if asked.
_OLD = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _OLD else {}
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
    """

    headers: tuple[str, ...]
    header_row: int
    rows: np.ndarray
    separator: str
    body: bytes
    filled: int
    skipped: int

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


def split_table(utf8: bytes, findings: FileFindings) -> CsvTable:
    """Split a text into headers and lines with the right number of cells.

    Args:
        utf8: text with plain newlines.
        findings: of the file; gets one for each line that does not fit.

    Returns:
        The table without the lines that do not fit.

    Raises:
        InputError: nothing in the file, or no header row.
    """
    if not utf8.strip():
        remedy = "Write a header row and at least 5 rows of readings"
        findings.refuse("the file is empty", remedy)
    text = utf8.lstrip(b"\n")
    header_row = len(utf8) - len(text) + 1
    line, _, body = text.partition(b"\n")
    separator, headers = _headers(line.decode(), findings, header_row)
    lines = body.split(b"\n")
    mark = ord(separator)
    filled = _per_line(body, {*range(33, 256)} - {mark}) > 0
    cells = _per_line(body, {mark}) + 1
    if b'"' in body:
        quotes = _per_line(body, {ord('"')})
        for index in np.flatnonzero(filled & (quotes > 0)):
            cells[index] = _quoted_cells(lines[index].decode(), separator)
    fits = filled & (cells == len(headers))
    rows = np.arange(len(lines)) + header_row + 1
    findings.add_rows(
        (int(rows[index]), *_misfit(int(cells[index]), len(headers), separator))
        for index in np.flatnonzero(filled & ~fits)
    )
    used = int(np.flatnonzero(filled)[-1]) + 1 if filled.any() else 0
    return CsvTable(
        headers=headers,
        header_row=header_row,
        rows=rows[fits],
        separator=separator,
        body=b"\n".join([*compress(lines, fits), b""]),
        filled=int(filled.sum()),
        skipped=int((~filled[:used]).sum()),
    )


def _per_line(text: bytes, counted: set[int]) -> np.ndarray:
    """How many bytes of some kinds each line holds."""
    others = bytes(set(range(256)) - counted - {ord("\n")})
    kept = text.translate(None, others)
    return np.array([len(line) for line in kept.split(b"\n")])


def _headers(
    line: str, findings: FileFindings, row: int
) -> tuple[str, tuple[str, ...]]:
    # a semicolon or a tab is never part of a number; a comma may be one
    separator = max(";\t", key=line.count)
    if separator not in line:
        separator = ","
    if line.count('"') % 2:
        findings.refuse("a quotation mark is not closed", "Close it", row)
    headers = tuple(cell.strip() for cell in _cells(line, separator))
    if all(_is_number(header) for header in headers):
        words = "the first row holds numbers where the headers should be"
        remedy = "Begin with a header row such as deformation_mm,force_N"
        findings.refuse(words, remedy, row)
    return separator, headers


def _quoted_cells(line: str, separator: str) -> int:
    """Number of cells; -1 for an open quotation mark, which would go on below."""
    reader = csv.reader([line, ""], delimiter=separator)
    try:
        cells = len(next(reader, []))
    except csv.Error:  # a cell longer than the csv module will hold
        cells = len(line.split(separator))
    # An open cell takes the empty line below along.
    open_ended = reader.line_num > 1 or line.count('"') % 2
    return -1 if open_ended else cells


def _misfit(cells: int, wanted: int, separator: str) -> tuple[str, str]:
    if cells < 0:
        return "a quotation mark is not closed", "Close it"
    words = f"has {cells} cells where the header row has {wanted}"
    remedy = f"Write {wanted} cells separated by a {_NAMES[separator]}"
    if separator == "," and cells > wanted:
        remedy += "; with decimal commas separate the columns by semicolons"
    return words, remedy


def _cells(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a cell longer than the csv module will hold
        return line.split(separator)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
