"""From cells to numbers and labels."""

import math
import re
from itertools import accumulate

import numpy as np

from hdcal.data.columns import LABELS, Column
from hdcal.data.csv_table import CsvTable
from hdcal.data.findings import FileFindings
from hdcal.data.formula_cells import with_formula
from hdcal.data.header_words import GROUPINGS
from hdcal.errors import quoted

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Whole numbers, their thousands behind points.
_IN_THOUSANDS = re.compile(r"[+-]?[1-9]?\d{1,2}(\.\d{3})*", re.ASCII)
# Label of what names none.
NOT_STATED = "not stated"
_ENDLESS = re.compile(r"[+-]?(inf|infinity|nan)", re.IGNORECASE)


def read_cells(
    table: CsvTable, columns: dict[str, Column], findings: FileFindings
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Read the used columns.

    Args:
        table: the cells.
        columns: by quantity.
        findings: of the file; gets one for each wrong cell.

    Returns:
        Floats in the file's units (NaN where a cell is wrong) or label strings, by
        quantity, each of shape (n,); and what was guessed of them.
    """
    labels = [c for c in columns.values() if c.quantity in LABELS]
    numeric = [c for c in columns.values() if c.quantity not in LABELS]
    numbers = table.numbers(c.position for c in numeric)
    values = {c.quantity: numbers[c.position] for c in numeric if c.position in numbers}
    # cell by cell, only where something odd stands in the column
    odd = [c for c in numeric if c.position not in numbers]
    texts, notes = table.texts(c.position for c in (*labels, *odd)), []
    for column in labels:
        cells = [with_formula(cell) for cell in texts[column.position]]
        if _stand_once(cells):
            words = "stands in the first row of each: the rows below it are taken for"
            notes.append(f"the label of {quoted(column.header)} {words} the same")
            cells = [*accumulate(cells, lambda above, own: own or above)]
        if column.quantity in GROUPINGS:
            cells = [cell or NOT_STATED for cell in cells]
        words = f"the {column.quantity} label is empty"
        empty = [
            (int(row), words, "Name it")
            for row, cell in zip(table.rows, cells, strict=True)
            if not cell
        ]
        findings.add_rows(empty, column.header, "empty labels")
        values[column.quantity] = np.array(cells, object)
    # One decimal sign serves a whole file, that of most cells: else a thousand passes
    # for a one.
    cells = [cell for column in odd for cell in texts[column.position]]
    commas = sum("," in cell for cell in cells)
    points = sum("." in cell and "," not in cell for cell in cells)
    comma = table.separator != "," and commas > 0 and commas >= points
    for column in odd:
        numbers, wrong = _read_numbers(table, texts[column.position], comma)
        findings.add_rows(wrong, column.header, "cells that are no numbers")
        values[column.quantity] = numbers
    for column in numeric:
        # Beside decimal commas a point was refused.
        if not comma and _may_hold_thousands(values[column.quantity]):
            cells = table.texts([column.position])[column.position]
            wrong = (
                (int(table.rows[i]), *_thousand(cells[i])) for i in _thousands(cells)
            )
            findings.add_rows(wrong, column.header, "cells that may be thousands")
    return values, notes


def _stand_once(labels: list[str]) -> bool:
    """Tell whether labels stand in the first row of what they name, as merged cells do.

    Where most rows name theirs, an empty one was forgotten.
    """
    return bool(labels) and bool(labels[0]) and 2 * labels.count("") > len(labels)


def _read_numbers(
    table: CsvTable, cells: list[str], comma: bool
) -> tuple[np.ndarray, list[tuple[int, str, str]]]:
    numbers, wrong = np.full(len(cells), np.nan), []
    for index, cell in enumerate(cells):
        try:
            numbers[index] = read_number(cell, comma)
        except CellError as error:
            wrong.append((int(table.rows[index]), *error.args))
    return numbers, wrong


def _may_hold_thousands(numbers: np.ndarray) -> bool:
    """Tell whether to look closer: all is whole or above one, some hundreds whole."""
    whole, size = numbers == np.round(numbers), np.abs(numbers)
    hundreds = whole & (size >= 100.0) & (size < 1000.0)
    return bool((whole | (size >= 1.0)).all() and hundreds.any())


def _thousands(cells: list[str]) -> list[int]:
    """Return which cells may be thousands written with a point.

    Beside 567 a 1.234, or a 1.000, is more likely a thousand than a one, where all
    others are whole.
    """
    if not all(_IN_THOUSANDS.fullmatch(cell) for cell in cells):
        return []
    pointed = [index for index, cell in enumerate(cells) if "." in cell]
    return pointed if len(pointed) < len(cells) else []


def _thousand(cell: str) -> tuple[str, str]:
    words = f"'{cell}' may be a thousand, as no other number here has decimals"
    remedy = f"Write {cell.replace('.', '')} if it is one, else {cell}0"
    return words, remedy


class CellError(ValueError):
    """A cell that is no number: the problem and the remedy, in words for the user."""


def read_number(cell: str, comma: bool) -> float:
    """Read one cell.

    Args:
        cell: without blanks around it.
        comma: whether its file is written with decimal commas.

    Raises:
        CellError: it is no finite number.
    """
    if not cell:
        raise CellError("the cell is empty", "Fill it in or leave out the row")
    if _ENDLESS.fullmatch(cell):
        words = f"'{cell}' is not a finite number"
        raise CellError(words, "Leave out the row if nothing was read")
    point = cell
    if comma:
        if "." in cell and "," not in cell and any(map(str.isdigit, cell)):
            words = f"'{cell}' has a decimal point among decimal commas"
            remedy = "Use one decimal sign in the whole file, and none for thousands"
            raise CellError(words, remedy)
        point = cell if "." in cell else cell.replace(",", ".")
    if not _NUMBER.fullmatch(point):
        remedy = "Write the reading, or leave out the row if there is none"
        if any(map(str.isdigit, cell)):
            remedy = "Write a plain number with a point, and no sign for thousands"
        raise CellError(f"'{cell}' is not a number", remedy)
    number = float(point)
    if math.isinf(number):
        words = f"'{cell}' is too large for a finite number"
        raise CellError(words, "Check the cell")
    return number
