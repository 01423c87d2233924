"""Tables in other shapes: units in cells, specimens side by side."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable, find_table
from hdcal.data.tables.cells import unit_in
from hdcal.data.tables.grid import Grid
from hdcal.data.tables.headers import parse_header
from hdcal.data.tables.headings import UNIT_LABELS
from hdcal.data.units import find_unit
from hdcal.errors import quoted

# Rows that show whether cells hold units.
_SHOWN = 50


def table_of(grid: Grid, findings: FileFindings) -> ReadTable:
    """Return the table in a grid, whatever its shape."""
    table, titles = find_table(grid, findings)
    return _stacked(_with_units(table, findings), titles)


def _with_units(table: ReadTable, findings: FileFindings) -> ReadTable:
    """Return a table whose headers have the units from columns behind them, or cells.

    A unit that changes from row to row, or differs from the header's, is a finding.
    """
    headers, notes = [*table.headers], [*table.notes]

    def refuse(name: str, units: Sequence[str]) -> None:
        words = " and ".join(map(quoted, units))
        problem = f"the unit of {quoted(name)} changes: {words}"
        findings.add(problem, "Convert the readings to one unit", table.header_row)

    for place, name in enumerate(headers[:-1]):
        if headers[place + 1].strip().casefold() not in UNIT_LABELS:
            continue
        units = [*filter(None, table.grid.labels(place + 1)[1])]
        if len(units) == 1 and find_unit(units[0]):
            headers[place] = f"{name} [{units[0]}]"
            words = f"the unit of {quoted(name)} stands in the column behind it"
            notes.append(f"{words}: {units[0]}")
        elif len(units) > 1 and any(map(find_unit, units)):
            refuse(name, units[:3])
    sample = table.grid.take(np.arange(len(table.rows)) < _SHOWN)
    for place, name in enumerate(headers):
        if sample.is_numeric(place) or not any(map(unit_in, sample.texts(place))):
            continue
        header = parse_header(name)
        known = header.unit.name if header.unit and header.quantity else ""
        units = [*dict.fromkeys(map(unit_in, table.grid.texts(place)))]
        units = [unit for unit in units if unit and find_unit(unit) != header.unit]
        if len(units) == 1 and not known:
            headers[place] = f"{name} [{units[0]}]"
        elif units and header.quantity:
            refuse(name, [known, *units[:3]] if known else units[:3])
    return replace(table, headers=tuple(headers), notes=tuple(notes))


def _stacked(table: ReadTable, titles: tuple[str, ...]) -> ReadTable:
    """Return a table with each column once, where specimens stand side by side.

    The titles, of the line above the headers, may name the specimens.
    """
    headers, width = table.headers, len(table.headers)
    periods = [p for p in range(2, width // 2 + 1) if width % p == 0]
    period = next((p for p in periods if headers[:p] * (width // p) == headers), 0)
    if not period or not all(headers) or len({*headers[:period]}) < period:
        return table
    cells = [table.grid.read(place) for place in range(width)]
    names, rows, blocks = [], [], []
    for start in range(0, width, period):
        each = np.array([cells[start + k] for k in range(period)], object)
        filled = np.any(each != "", axis=0)
        names.append(titles[start] or str(start // period + 1))
        rows.append(table.rows[filled])
        label = np.full((1, filled.sum()), names[-1], object)
        blocks.append(np.concatenate([each[:, filled], label]))
    columns = np.concatenate(blocks, axis=1)
    grid = Grid(np.concatenate(rows), [*columns])
    note = f"{len(names)} specimens stand side by side: {', '.join(map(quoted, names))}"
    return replace(
        table,
        headers=(*headers[:period], "specimen"),
        grid=grid,
        filled=len(grid.rows),
        empty=frozenset(),
        notes=(*table.notes, note),
        runs=None,
    )
