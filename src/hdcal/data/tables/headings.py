"""Headings of blocks: the lines of names and units above their readings."""

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from hdcal.data.tables.grid import SourceLine
from hdcal.data.tables.headers import DIMENSIONS, LABELS, is_unit_text, parse_header
from hdcal.data.units import find_unit

_NEAR = 20  # lines above the readings among which the names stand
# Words before a row of units, and names of columns of them.
UNIT_LABELS = {"unit", "units", "einheit", "einheiten", "unité", "単位", "单位"}
UNIT_LABELS |= {"y_unit_label"}
_MARK = re.compile(r"\A\s*[#%*/]+\s*")


class Heading(NamedTuple):
    """Names and units of a block."""

    names: tuple[str, ...]  # with their units in brackets, shape (c,)
    bare: tuple[str, ...] = ()  # as written, shape (c,)
    row: int = 0  # of the names in the source; 0 where there are none
    last: int = 0  # row of the last of names and units
    unit_row: int | None = None
    cells: int = 0  # number of names
    conflicts: Mapping[int, str] = MappingProxyType({})  # units of the row of units


def find_heading(
    lines: list[SourceLine], width: int, first: Heading | None = None
) -> Heading | None:
    """Return names and units among the lines above a block.

    The names are the line with the most quantities, else the line right above the
    readings or their units. `first` is the heading of the first block, for later ones.
    """
    if first is not None and not first.row:
        return None
    near = lines[-_NEAR:]
    units = next((line for line in lines[::-1] if _is_unit_line(line, near)), None)
    cells = _padded(units.cells if units is not None else [], width)
    texts = [cell.strip("()[] ") if is_unit_text(cell) else "" for cell in cells]
    named = [(_quantities(n, texts), n.row, n) for n in near if n != units]
    named = [entry for entry in named if _may_name(entry[2], entry[0], width)]
    if not named and units is not None and units in near:
        # Names of columns may be letters, as N and s are.
        named, units, texts = [(0, units.row, units)], None, [""] * width
    if not named:
        return None
    # One quantity may stand in a title too.
    quantities, _, best = max(named, key=lambda n: (n[0] > 1 and n[0], n[1]))
    bare = tuple(_bare_names(best, lines, width))
    last = max(best.row, units.row if units is not None else 0)
    if first is not None and bare == first.bare:
        return first._replace(row=best.row, last=last)
    below = [line for line in lines if line != units and line.row > best.row]
    if not quantities and (first or not all(line.counts for line in below)):
        return None
    return Heading(
        names=tuple(map(_with_unit, bare, texts)),
        bare=bare,
        row=best.row,
        last=last,
        unit_row=None if units is None else units.row,
        cells=len(best.cells),
        conflicts=_conflicts(bare, texts),
    )


def _may_name(line: SourceLine, quantities: int, width: int) -> bool:
    """Tell whether a line may hold names: not more than a reading has cells."""
    filled = max((i + 1 for i, cell in enumerate(line.cells) if cell), default=0)
    several = filled >= 2 or line.fits
    words = not line.counts or (quantities > 0 and line.numbers < filled)
    return several and filled <= width and words


def _quantities(line: SourceLine, units: list[str]) -> int:
    """Return how many cells of a line name a quantity of a spring, or a run."""
    pairs = zip(line.cells, _padded(units, len(line.cells)), strict=True)
    headers = [parse_header(_with_unit(_MARK.sub("", n), unit)) for n, unit in pairs]
    return sum(h.quantity in (*DIMENSIONS, *LABELS[:2]) for h in headers)


def _is_unit_line(line: SourceLine, near: list[SourceLine]) -> bool:
    """Tell whether a line holds units, behind a label such as 'Unit' or near names."""
    filled = [cell for cell in line.cells if cell]
    if not filled or line.numbers:
        return False
    if filled[0].strip(" :").casefold() in UNIT_LABELS:
        return any(map(is_unit_text, filled[1:]))
    units = sum(map(is_unit_text, filled))
    return line in near and any(map(find_unit, filled)) and 2 * units > len(filled)


def _bare_names(line: SourceLine, lines: list[SourceLine], width: int) -> list[str]:
    """Return headers as written; LabVIEW's first one where it is the time."""
    names = _padded(line.cells, width)
    names[0] = _MARK.sub("", names[0])
    timed = any(each.cells[:2] == ["X_Dimension", "Time"] for each in lines)
    if names[0] == "X_Value" and names.count("X_Value") == 1 and timed:
        names[0] = "X_Value (Time) [s]"
    return names


def _with_unit(name: str, unit: str) -> str:
    """Return a header with its unit, where it names none itself."""
    header = parse_header(name)
    known = header.unit is not None and bool(header.quantity)
    return f"{name} [{unit}]".strip() if unit and not known else name


def _conflicts(names: Sequence[str], units: Sequence[str]) -> dict[int, str]:
    """Return the units of the row of units that differ from headers, by position."""
    conflicts = {}
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        header, other = parse_header(name), find_unit(unit)
        named = header.unit if header.quantity else None
        if named is not None and unit and other != named:
            conflicts[place] = unit
    return conflicts


def _padded(cells: list[str], width: int) -> list[str]:
    """Return cells with empty ones behind them, shape (c,)."""
    return [*cells, *[""] * width][:width]
