"""Where the table begins in a file that a machine wrote: below titles, above units.

An ordinary file has its headers in the first line. Elsewhere the readings tell: from
some line on all lines have as many cells, and numbers in them.
"""

import csv
import re
from typing import NamedTuple

from hdcal.data.header_words import GROUPINGS, guess_header
from hdcal.data.units import COLUMN_UNITS, known_unit

# Titles are sought in this many lines; so many lines of readings are a table.
_TITLES, _READINGS = 200, 5
_SEPARATORS = "\t;,"
_MARK = re.compile(r"\s*[#%*/]+\s*")
# LabVIEW's headers hold rows of numbers too, of each channel, and end with this.
_HEADER_ENDS = "***End_of_Header***"
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)


class TableStart(NamedTuple):
    """Where a table begins; lines count from 0.

    Attributes:
        headers: line of the headers; None where the readings have none.
        units: line of their units; None without one.
        readings: first line of the readings.
        torn: lines of numbers right above the readings, which have more cells than
            these, or fewer.
    """

    headers: int | None
    units: int | None
    readings: int
    torn: tuple[int, ...] = ()


def find_start(text: str) -> TableStart | None:
    """Return where the table begins; None where the text has none below its titles.

    Args:
        text: of the file, lines ended by a newline.
    """
    lines = text.split("\n", _TITLES + _READINGS)[: _TITLES + _READINGS]
    filled = [index for index, line in enumerate(lines) if line.strip()]
    if not filled or lines[filled[0]].count('"') % 2:
        return None
    for separator in _SEPARATORS:
        cells = {index: split_line(lines[index], separator) for index in filled}
        for place, first in enumerate(filled[:-1]):
            width = len(cells[first])
            if width < 2 or not is_reading(cells[first], width):
                continue
            above = [index for index in filled[:place] if len(cells[index]) == width]
            # One of them may be spoiled: it is told of later.
            block = filled[place : place + _READINGS]
            readings = sum(is_reading(cells[i], width) for i in block)
            if any(lines[index].startswith(_HEADER_ENDS) for index in block):
                continue
            named = any(_names(cells[index]) for index in above[-2:])
            if readings < len(block) - 1 and not named:
                continue
            return _start(above, cells, filled[:place], first)
    return None


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of a line without blanks around them."""
    try:
        found = next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a cell longer than the csv module will hold
        found = line.split(separator)
    return [cell.strip() for cell in found]


def header_cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line of headers, which may be marked as a comment."""
    mark = _MARK.match(line)
    return split_line(line[mark.end() :] if mark else line, separator)


def is_number(cell: str) -> bool:
    """Tell whether a cell holds a number, its sign a point or a comma."""
    return _NUMBER.fullmatch(cell) is not None


def is_reading(cells: list[str], width: int) -> bool:
    """Tell whether cells are as many as those of a reading, two of them numbers."""
    return len(cells) == width and sum(map(is_number, cells)) >= 2


def unit_in(cell: str) -> str:
    """Return the unit that a cell holds and nothing else, empty without one."""
    bare = cell.strip("()[] ")
    known = any(known_unit(quantity, bare) for quantity in COLUMN_UNITS)
    return bare if known else ""


def _start(
    above: list[int], cells: dict[int, list[str]], every: list[int], first: int
) -> TableStart:
    """Return which lines above the readings are headers and units.

    Args:
        above: lines as wide as the readings.
        cells: of each line.
        every: filled lines above the readings.
        first: line of the readings.
    """
    named = [i for i in above if _names(cells[i])]
    titled = bool(named) and above[0] not in named
    if above and above[0] == every[0] and all(cells[above[0]]) and not titled:
        # A whole first line names the columns, whatever is wrong below it.
        second = above[0] + 1
        units = second if _are_units(cells, above[1:2]) else None
        return TableStart(above[0], units, second + (units is not None))
    torn: tuple[int, ...] = ()
    while every and every[-1] not in above and is_number(cells[every[-1]][0]):
        every, torn = every[:-1], (every[-1], *torn)
    if not above or above[-1] != every[-1]:
        return TableStart(None, None, first, torn)
    if _are_units(cells, above[-1:]) and len(above) > 1:
        return TableStart(above[-2], above[-1], first, torn)
    return TableStart(above[-1], None, first, torn)


def _names(cells: list[str]) -> bool:
    """Tell whether cells are headers, some of a quantity that is known."""
    guesses = filter(None, map(guess_header, cells))
    # Who tested and which lot stand above a table too.
    return any(guess.quantity not in GROUPINGS for guess in guesses)


def _are_units(cells: dict[int, list[str]], lines: list[int]) -> bool:
    """Tell whether the one line holds units and nothing else."""
    found = [cell for index in lines for cell in cells[index] if cell]
    return bool(found) and all(map(unit_in, found))
