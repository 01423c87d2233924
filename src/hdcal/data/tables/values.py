"""Values of the columns that are used: numbers in code units, and labels."""

from collections.abc import Mapping

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.cells import (
    NOT_STATED,
    Fault,
    has_comma,
    may_hold_thousands,
    read_numbers,
    thousands,
    with_formula,
)
from hdcal.data.tables.columns import Column
from hdcal.data.tables.headers import GROUPINGS, LABELS
from hdcal.errors import quoted

# Share of cells from which on a column is no slow channel, and cells that make one.
_SLOW, _FEWEST = 0.5, 5


def read_values(
    table: ReadTable, used: Mapping[str, Column], findings: FileFindings
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the used columns by quantity, shape (n,) each, and notes.

    Floats in code units, NaN where a cell is wrong, which is a finding; or labels.
    """
    notes: list[str] = []
    values = _numbers(table, used, findings)
    for quantity, column in used.items():
        if column.unit is None:
            values[quantity] = _labels(table, column, findings, notes)
        else:
            # A wild number may overflow here; the limits of readings report it.
            with np.errstate(over="ignore"):
                values[quantity] = column.unit.convert(values[quantity])
    return values, notes


def without_slow_channels(
    table: ReadTable, used: Mapping[str, Column], required: tuple[str, ...]
) -> tuple[ReadTable, dict[str, Column], list[str]]:
    """Return the rows in which slow channels were read as well, and notes on the rest.

    A channel that is read more seldom than others leaves most of its cells empty. Where
    it is no required one, it is not used.
    """
    kept, left, notes = np.ones(len(table.rows), bool), dict(used), []
    for quantity, column in used.items():
        cells = table.grid.read(column.position)
        if quantity in LABELS or cells.dtype != object:
            continue
        filled = np.array([cell != "" for cell in cells.tolist()])
        if not len(filled) or filled.mean() > _SLOW:
            continue
        if quantity in required and not _is_regular(filled):
            continue
        name, many = quoted(column.header), f"{(~filled).sum()} of {len(filled)} rows"
        if quantity in required:
            kept &= filled
            notes.append(f"{name} is empty in {many}; these rows are left out")
        else:
            del left[quantity]
            notes.append(f"{name} is not used, because it is empty in {many}")
    return table if kept.all() else table.take(kept), left, notes


def _is_regular(filled: np.ndarray) -> bool:
    """Tell whether cells, a mask of shape (n,), are filled at about equal distances."""
    gaps = np.diff(np.concatenate([[-1], np.flatnonzero(filled), [len(filled)]]))
    return bool(filled.sum() >= _FEWEST and gaps.max() <= 2 * np.median(gaps))


def _numbers(
    table: ReadTable, used: Mapping[str, Column], findings: FileFindings
) -> dict[str, np.ndarray]:
    numeric = {name: column for name, column in used.items() if name not in LABELS}
    cells = {name: table.grid.read(one.position) for name, one in numeric.items()}
    comma = has_comma(cells.values())
    values = {}
    for name, column in numeric.items():
        values[name], faults = read_numbers(cells[name], comma)
        # Beside decimal commas a point was refused.
        if not comma and not faults and may_hold_thousands(values[name]):
            faults = thousands(table.grid.texts(column.position))
        _add(table, faults, column, findings)
    return values


def _labels(
    table: ReadTable, column: Column, findings: FileFindings, notes: list[str]
) -> np.ndarray:
    """Return the label of each row; one in the first of many rows is repeated."""
    index, texts = table.grid.labels(column.position)
    empty = np.array([text == "" for text in texts], bool)[index]
    # As merged cells do; where most rows have a label, an empty one was forgotten.
    if len(index) and not empty[0] and 2 * empty.sum() > len(index):
        words = "is in the first row of each group only; it is used for the rows below"
        notes.append(f"the label of {quoted(column.header)} {words}")
        last = np.maximum.accumulate(np.where(empty, 0, np.arange(len(index))))
        index, empty = index[last], np.zeros(len(index), bool)
    optional = column.quantity in GROUPINGS
    if not optional:
        words = f"the {column.quantity} label is empty"
        places = np.flatnonzero(empty).tolist()
        faults = [(place, words, "Fill in the label") for place in places]
        _add(table, faults, column, findings)
    blank = NOT_STATED if optional else ""
    return np.array([with_formula(text) or blank for text in texts], object)[index]


def _add(
    table: ReadTable, faults: list[Fault], column: Column, findings: FileFindings
) -> None:
    rows = table.rows
    each = ((int(rows[place]), words, remedy) for place, words, remedy in faults)
    findings.add_rows(each, column.header)
