"""Numbers in cells: their decimal mark, and what cells that hold none are."""

import math
import re
from collections.abc import Iterable

import numpy as np

from hdcal.data.units import UNITS

NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
_UNITS = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_WITH_UNIT = re.compile(rf"(?P<number>[+-]?[\d.,eE+-]+)\s*(?P<unit>{_UNITS})")
_POINT = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Whole numbers, their thousands marked by points.
_IN_THOUSANDS = re.compile(r"[+-]?[1-9]?\d{1,2}(\.\d{3})*", re.ASCII)
# The same by commas, at least once.
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)
_ENDLESS = re.compile(r"[+-]?(inf|infinity|nan)", re.IGNORECASE)
# Label of what names none.
NOT_STATED = "not stated"
# Row in the array, problem and remedy.
Fault = tuple[int, str, str]


class CellError(ValueError):
    """A cell that is no number: the problem and the remedy, in words for the user."""


def is_number(cell: str) -> bool:
    """Tell whether a cell holds a number, its decimal mark a point or a comma."""
    return NUMBER.fullmatch(cell) is not None or bool(unit_in(cell))


def unit_in(cell: str) -> str:
    """Return the unit behind the number in a cell, as in '12.5 N'; empty without."""
    found = _WITH_UNIT.fullmatch(cell)
    known = found is not None and NUMBER.fullmatch(found["number"])
    return found["unit"] if found is not None and known else ""


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
    cell = cell.removesuffix(unit_in(cell)).rstrip()
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
    if not _POINT.fullmatch(point):
        remedy = "Write the reading, or leave out the row if there is none"
        if any(map(str.isdigit, cell)):
            remedy = "Write a plain number with a point, and no sign for thousands"
        raise CellError(f"'{cell}' is not a number", remedy)
    number = float(point)
    if math.isinf(number):
        words = f"'{cell}' is too large for a finite number"
        raise CellError(words, "Check the cell")
    return number


def has_comma(columns: Iterable[np.ndarray]) -> bool:
    """Tell whether the texts in some columns have decimal commas.

    One decimal mark serves a whole source, that of most cells. Beside numbers that are
    stored as such, commas that may all mark thousands do not count.

    Args:
        columns: objects, shape (n,) each, texts or numbers.
    """
    cells = [cell for column in columns for cell in column.tolist()]
    texts = [cell for cell in cells if isinstance(cell, str) and NUMBER.match(cell)]
    commas = [cell for cell in texts if "," in cell]
    points = sum("." in cell and "," not in cell for cell in texts)
    stored = any(not isinstance(cell, str) and cell % 1 for cell in cells)
    if stored and all(map(_THOUSANDS.fullmatch, commas)):
        return False
    return bool(commas) and len(commas) >= points


def read_numbers(cells: np.ndarray, comma: bool) -> tuple[np.ndarray, list[Fault]]:
    """Read a column that is no plain array of numbers.

    Args:
        cells: texts without blanks around them, or numbers, shape (n,).
        comma: whether texts have decimal commas.

    Returns:
        Floats, NaN where a cell is wrong, shape (n,); and what is wrong.
    """
    numbers, wrong = np.full(len(cells), np.nan), []
    for index, cell in enumerate(cells.tolist()):
        stored = not isinstance(cell, str)
        if stored and not isinstance(cell, bool) and math.isfinite(cell):
            numbers[index] = cell
            continue
        try:
            numbers[index] = read_number(str(cell), comma)
        except CellError as error:
            wrong.append((index, *error.args))
    return numbers, wrong


def may_hold_thousands(numbers: np.ndarray) -> bool:
    """Tell whether to look closer: all is whole or above one, some hundreds whole."""
    whole, size = numbers == np.round(numbers), np.abs(numbers)
    hundreds = whole & (size >= 100.0) & (size < 1000.0)
    return bool((whole | (size >= 1.0)).all() and hundreds.any())


def thousands(cells: list[str]) -> list[Fault]:
    """Return which cells may be thousands that are marked by a point.

    Beside 567 a 1.234, or a 1.000, is more likely a thousand than a one, where all
    others are whole.
    """
    if not all(_IN_THOUSANDS.fullmatch(cell) for cell in cells):
        return []
    pointed = [index for index, cell in enumerate(cells) if "." in cell]
    if len(pointed) == len(cells):
        return []
    words = "may be a thousand, as no other number here has decimals"
    return [
        (
            index,
            f"'{cells[index]}' {words}",
            f"Write {cells[index].replace('.', '')} if it is one, else {cells[index]}0",
        )
        for index in pointed
    ]
