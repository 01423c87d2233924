"""Numbers in cells: their decimal mark, and what is wrong with cells that hold none."""

import math
import re
from collections.abc import Iterable
from contextlib import suppress

import numpy as np

from hdcal.data.units import UNITS

# Also one with points for thousands and a decimal comma: 1.042,00.
NUMBER = re.compile(
    r"[+-]?(\d+([.,]\d*)?|[.,]\d+|\d+(\.\d+)+,\d*)([eE][+-]?\d+)?", re.ASCII
)
_GROUPED = r"[1-9]\d{0,2}(\.\d{3})+"
_BOTH = re.compile(rf"[+-]?{_GROUPED},\d*", re.ASCII)
_EITHER = re.compile(rf"[+-]?(\d+|{_GROUPED})?(,\d*)?", re.ASCII)
_POINT = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Float() takes more than numbers: nan, inf, 1_000.
_PLAIN = re.compile(r"[-+.eE\d\n]+", re.ASCII)
_UNITS = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_WITH_UNIT = re.compile(rf"([+-]?[\d.,eE+-]+)\s*({_UNITS})")
# Whole numbers whose thousands are marked by points; by commas, at least once.
_POINTED = re.compile(r"[+-]?[1-9]?\d{1,2}(\.\d{3})*", re.ASCII)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)
# First characters of a text that a spreadsheet would run as a formula. A leading
# apostrophe makes it show the rest as text.
_RUN = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "\t", "\r")
NOT_STATED = "not stated"  # label of a row whose source states none
# Index, problem and remedy of a cell.
Fault = tuple[int, str, str]


class CellError(ValueError):
    """A cell that is no number; its arguments are the problem and the remedy."""


def is_number(cell: str) -> bool:
    """Tell whether a cell holds a number, its decimal mark a point or a comma."""
    return NUMBER.fullmatch(cell) is not None or bool(unit_in(cell))


def unit_in(cell: str) -> str:
    """Return the unit behind the number in a cell, as in '12.5 N'; else ''."""
    parts = _WITH_UNIT.fullmatch(cell)
    return parts[2] if parts is not None and NUMBER.fullmatch(parts[1]) else ""


def are_numbers(cells: np.ndarray) -> np.ndarray:
    """Tell which cells hold numbers, shape (n,)."""
    if _plain_floats(cells, ".,") is not None:
        return np.ones(len(cells), bool)
    held = [not isinstance(c, str) or is_number(c) for c in cells.tolist()]
    return np.array(held, bool)


def read_number(cell: str, comma: bool) -> float:
    """Return the finite number in a cell, or raise CellError."""
    if not cell:
        raise CellError("the cell is empty", "Fill it in or leave out the row")
    cell = cell.removesuffix(unit_in(cell)).rstrip()
    digits, point = any(map(str.isdigit, cell)), cell
    if comma and "." not in cell:
        point = cell.replace(",", ".")
    elif comma and "," not in cell and digits:
        remedy = "Use one decimal sign in the whole file, and no thousands separator"
        raise CellError(f"'{cell}' has a decimal point among decimal commas", remedy)
    if not _POINT.fullmatch(point):
        remedy = "Write the reading, or leave out the row if there is none"
        if digits:
            remedy = "Write the number with a decimal point and no thousands separator"
        raise CellError(f"'{cell}' is not a number", remedy)
    if math.isinf(number := float(point)):
        raise CellError(f"'{cell}' is too large", "Check the number")
    return number


def has_comma(columns: Iterable[np.ndarray]) -> bool:
    """Tell whether the texts in some columns have decimal commas.

    One decimal mark serves a whole source, that of most cells. Beside numbers that are
    stored as such, commas that may all mark thousands do not count.
    """
    cells = [cell for column in columns for cell in column.tolist()]
    texts = [cell for cell in cells if isinstance(cell, str)]
    commas = [cell for cell in texts if "," in cell and NUMBER.match(cell)]
    if not commas:
        return False
    points = sum("." in c and "," not in c and bool(NUMBER.match(c)) for c in texts)
    stored = any(not isinstance(cell, str) and cell % 1 for cell in cells)
    if stored and all(map(_THOUSANDS.fullmatch, commas)):
        return False
    return len(commas) >= points


def read_numbers(cells: np.ndarray, comma: bool) -> tuple[np.ndarray, list[Fault]]:
    """Return the cells of a column as floats, NaN where wrong, and the faults."""
    if cells.dtype != object:
        return cells, []
    if comma and mark_thousands(cells):
        cells = np.array([cell.replace(".", "") for cell in cells.tolist()], object)
    if (floats := _plain_floats(cells, "," if comma else ".")) is not None:
        return floats, []
    numbers, faults = np.full(len(cells), np.nan), []
    for index, cell in enumerate(cells.tolist()):
        try:
            if type(cell) in (float, int) and math.isfinite(cell):
                numbers[index] = cell
            else:
                numbers[index] = read_number(str(cell), comma)
        except CellError as error:
            faults.append((index, *error.args))
    return numbers, faults


def _plain_floats(cells: np.ndarray, marks: str) -> np.ndarray | None:
    """Return texts as floats if all are finite numbers with one of the marks."""
    texts = cells.tolist()
    try:
        joined = "\n".join(texts)
    except TypeError:  # stored numbers among them
        return None
    used = {mark for mark in ".," if mark in joined}
    if len(used) > 1 or not used <= {*marks}:
        return None
    joined = joined.replace(",", ".")
    if not _PLAIN.fullmatch(joined) or joined.count("\n") != len(texts) - 1:
        return None
    try:
        floats = np.array(joined.split("\n"), float)
    except ValueError:
        return None
    return floats if np.isfinite(floats).all() else None


def mark_thousands(cells: np.ndarray) -> bool:
    """Tell whether all points in texts with decimal commas mark thousands: 1.042,00."""
    texts = cells.tolist()
    if not all(isinstance(cell, str) for cell in texts):
        return False
    return any(map(_BOTH.fullmatch, texts)) and all(map(_EITHER.fullmatch, texts))


def may_hold_thousands(numbers: np.ndarray) -> bool:
    """Tell whether to look closer: all is whole or above one, some hundreds whole."""
    whole, size = numbers == np.round(numbers), np.abs(numbers)
    hundreds = whole & (size >= 100.0) & (size < 1000.0)
    return bool((whole | (size >= 1.0)).all() and hundreds.any())


def thousands(cells: list[str]) -> list[Fault]:
    """Return the cells that may be thousands marked by a point.

    Beside 567 a 1.234, or a 1.000, is more likely a thousand than a one, where all
    others are whole.
    """
    pointed = [index for index, cell in enumerate(cells) if "." in cell]
    if len(pointed) == len(cells) or not all(map(_POINTED.fullmatch, cells)):
        return []
    words = "may be in thousands, as no other number in the column has decimals"
    return [
        (
            index,
            f"'{cells[index]}' {words}",
            f"Write {cells[index].replace('.', '')} if it is one, else {cells[index]}0",
        )
        for index in pointed
    ]


def without_formula(text: str) -> str:
    """Return a text as it may stand in a cell; numbers are no formulas."""
    return f"'{text}" if _runs(text) else text


def with_formula(cell: str) -> str:
    """Return the text that `without_formula` made a cell of."""
    return cell.removeprefix("'") if _runs(cell) else cell


def _runs(text: str) -> bool:
    """Tell whether a spreadsheet would run a text, less its guards."""
    with suppress(ValueError):
        float(text)
        return False
    return text.lstrip("'").startswith(_RUN)
