"""How a table is laid out: separator, headers, and which lines hold readings."""

import csv
from dataclasses import dataclass

import numpy as np

from hdcal.errors import Finding, InputError

LISTED = 20  # findings of one kind that are spelled out before "and N more"
_NAMES = {",": "comma", ";": "semicolon", "\t": "tab"}


@dataclass(frozen=True)
class Layout:
    """The parts of a table.

    Attributes:
        separator: comma, semicolon or tab.
        headers: stripped, in the order of the file.
        header_row: line of the headers, 1 = first line of the file.
        body: the usable data lines, UTF-8, each ended by a newline.
        rows: line number of each line of the body, shape (n,).
        data_rows: number of lines with any cell in them, usable or not.
        skipped: number of empty lines between the data.
        quoted: whether the body holds quotation marks.
    """

    separator: str
    headers: tuple[str, ...]
    header_row: int
    body: bytes
    rows: np.ndarray
    data_rows: int
    skipped: int
    quoted: bool


def lay_out(utf8: bytes, file: str) -> tuple[Layout, list[Finding]]:
    """Split a text into headers and lines with the right number of cells.

    Args:
        utf8: text with plain newlines.
        file: how the user named the file.

    Returns:
        The layout without the lines that do not fit, and a finding for each.

    Raises:
        InputError: nothing in the file, or no header row.
    """
    if not utf8.strip():
        remedy = "Write a header row and at least 5 rows of readings"
        raise InputError([Finding(file, "the file is empty", remedy)])
    blank_lines = len(utf8) - len(utf8.lstrip(b"\n"))
    line, _, rest = utf8.lstrip(b"\n").partition(b"\n")
    separator, headers = _headers(line.decode(), file, blank_lines + 1)
    if rest and not rest.endswith(b"\n"):
        rest += b"\n"
    return _body(rest, separator, headers, blank_lines + 1, file)


def _headers(line: str, file: str, row: int) -> tuple[str, tuple[str, ...]]:
    # a semicolon or a tab is never part of a number; a comma may be one
    separator = max(";\t", key=line.count)
    if separator not in line:
        separator = ","
    if line.count('"') % 2:
        problem, remedy = "a quotation mark is not closed", "Close it"
        raise InputError([Finding(file, problem, remedy, row)])
    cells = [cell.strip() for cell in _cells(line, separator)]
    if all(_is_number(cell) for cell in cells):
        words = "the first row holds numbers where the headers should be"
        remedy = "Begin with a header row such as deformation_mm,force_N"
        raise InputError([Finding(file, words, remedy, row)])
    return separator, tuple(cells)


def _body(
    rest: bytes, separator: str, headers: tuple[str, ...], header_row: int, file: str
) -> tuple[Layout, list[Finding]]:
    codes = np.frombuffer(rest, np.uint8)
    stops = np.flatnonzero(codes == 10)
    starts = np.concatenate([[0], stops[:-1] + 1]).astype(int) if stops.size else stops
    cells = _per_line(codes == ord(separator), starts) + 1
    filled = _per_line((codes != ord(separator)) & (codes > 32), starts) > 0
    good = filled & (cells == len(headers))
    findings = []
    quoted = b'"' in rest
    if quoted:
        quotes = _per_line(codes == ord('"'), starts)
        for index in np.flatnonzero(filled & (quotes > 0)):
            text = rest[starts[index] : stops[index]].decode()
            # an open quotation mark would swallow the lines after it
            closed = quotes[index] % 2 == 0
            cells[index] = len(_cells(text, separator)) if closed else -1
            good[index] = cells[index] == len(headers)
    rows = np.arange(len(stops)) + header_row + 1
    for index in np.flatnonzero(filled & ~good)[:LISTED]:
        where = int(rows[index])
        findings.append(
            _misfit(int(cells[index]), len(headers), separator, file, where)
        )
    findings += and_more(int((filled & ~good).sum()), "rows like these", file)
    last = int(np.flatnonzero(filled)[-1]) + 1 if filled.any() else 0
    if not good[:last].all():
        pieces = [rest[starts[i] : stops[i] + 1] for i in np.flatnonzero(good)]
        rest = b"".join(pieces)
    else:
        rest = rest[: stops[last - 1] + 1] if last else b""
    layout = Layout(
        separator=separator,
        headers=headers,
        header_row=header_row,
        body=rest,
        rows=rows[good],
        data_rows=int(filled.sum()),
        skipped=int((~filled[:last]).sum()),
        quoted=quoted,
    )
    return layout, findings


def and_more(
    count: int, what: str, file: str, column: str | None = None
) -> list[Finding]:
    """One finding for all that were not spelled out, or none."""
    if count <= LISTED:
        return []
    words = f"and {count - LISTED} more {what}"
    return [Finding(file, words, "Mend all of them", None, column)]


def _per_line(mask: np.ndarray, starts: np.ndarray) -> np.ndarray:
    # a running sum would need eight bytes per character of the file
    if not starts.size:
        return np.zeros(0, int)
    hits = np.flatnonzero(mask)
    edges = np.searchsorted(hits, np.append(starts, mask.size))
    return np.diff(edges)


def _misfit(cells: int, wanted: int, separator: str, file: str, row: int) -> Finding:
    if cells < 0:
        return Finding(file, "a quotation mark is not closed", "Close it", row)
    words = f"has {cells} cells where the header row has {wanted}"
    remedy = f"Write {wanted} cells separated by a {_NAMES[separator]}"
    if separator == "," and cells > wanted:
        remedy += "; with decimal commas separate the columns by semicolons"
    return Finding(file, words, remedy, row)


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
