"""How many cells each line of a text holds, and what to say of one with too many."""

import csv

import numpy as np

_NAMES = {",": "comma", ";": "semicolon", "\t": "tab"}


def filled_cells(lines: list[bytes], separator: str) -> tuple[np.ndarray, np.ndarray]:
    """Return which lines hold anything, and how many cells each has, by line."""
    body = b"\n".join(lines)
    mark = ord(separator)
    filled = _per_line(body, {*range(33, 256)} - {mark}) > 0
    cells = _per_line(body, {mark}) + 1
    if b'"' in body:
        quotes = _per_line(body, {ord('"')})
        for index in np.flatnonzero(filled & (quotes > 0)):
            cells[index] = _quoted_cells(lines[index].decode(), separator)
    return filled, cells


def misfit(cells: int, wanted: int, separator: str) -> tuple[str, str]:
    """Return what is wrong with a line that holds another number of cells."""
    if cells < 0:
        return "a quotation mark is not closed", "Close it"
    words = f"has {cells} cells where the header row has {wanted}"
    remedy = f"Write {wanted} cells separated by a {_NAMES[separator]}"
    if separator == "," and cells > wanted:
        remedy += "; with decimal commas separate the columns by semicolons"
    return words, remedy


def _per_line(text: bytes, counted: set[int]) -> np.ndarray:
    """How many bytes of some kinds each line holds."""
    others = bytes(set(range(256)) - counted - {ord("\n")})
    kept = text.translate(None, others)
    return np.array([len(line) for line in kept.split(b"\n")])


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
