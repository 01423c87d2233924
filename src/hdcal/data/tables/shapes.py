"""Tables in other shapes: units in cells, specimens side by side or in sheets."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable, find_table
from hdcal.data.tables.cells import unit_in
from hdcal.data.tables.grid import ArrayGrid, Grid
from hdcal.data.tables.headers import parse_header
from hdcal.data.tables.headings import UNIT_LABELS
from hdcal.data.units import find_unit
from hdcal.errors import quoted

# Rows that show whether cells hold units.
_SHOWN = 50


def table_of(grid: Grid, findings: FileFindings) -> ReadTable:
    """Return the table in a grid, whatever its shape."""
    table, titles = find_table(grid, findings)
    table = with_unit_cells(with_unit_columns(table, findings), findings)
    return stacked(table, titles)


def with_unit_columns(table: ReadTable, findings: FileFindings) -> ReadTable:
    """Return a table whose headers have the units from columns behind them.

    Args:
        table: the readings.
        findings: of the source; gets one where a unit changes from row to row.
    """
    headers, notes = [*table.headers], [*table.notes]
    for place in range(1, len(headers)):
        label = headers[place].strip().casefold()
        if label not in UNIT_LABELS:
            continue
        units = [*dict.fromkeys(filter(None, table.grid.texts(place)))]
        name = headers[place - 1]
        if len(units) == 1 and find_unit(units[0]):
            headers[place - 1] = f"{name} [{units[0]}]"
            notes.append(
                f"the unit of {quoted(name)} stands in the column behind it: {units[0]}"
            )
        elif len(units) > 1 and any(map(find_unit, units)):
            several = " and ".join(map(quoted, units[:3]))
            words = f"the unit of {quoted(name)} changes: {several}"
            findings.add(words, "Convert the readings to one unit", table.header_row)
    return replace(table, headers=tuple(headers), notes=tuple(notes))


def with_unit_cells(table: ReadTable, findings: FileFindings) -> ReadTable:
    """Return a table whose headers have the units that stand in their cells.

    Args:
        table: the readings.
        findings: of the source; gets one where a unit changes from row to row, or is
            another one than that of the header.
    """
    first = np.arange(len(table.rows)) < _SHOWN
    headers, sample = [*table.headers], table.grid.take(first)
    for place, name in enumerate(headers):
        if sample.is_numeric(place) or not any(map(unit_in, sample.texts(place))):
            continue
        units = [*dict.fromkeys(map(unit_in, table.grid.texts(place)))]
        header = parse_header(name)
        known = header.unit.name if header.unit and header.quantity else ""
        units = [unit for unit in units if unit and find_unit(unit) != header.unit]
        if len(units) == 1 and not known:
            headers[place] = f"{name} [{units[0]}]"
        elif units and header.quantity:
            several = [known, *units[:3]] if known else units[:3]
            several = " and ".join(map(quoted, several))
            words = f"the unit of {quoted(name)} changes: {several}"
            findings.add(words, "Convert the readings to one unit", table.header_row)
    return replace(table, headers=tuple(headers))


def stacked(table: ReadTable, titles: tuple[str, ...]) -> ReadTable:
    """Return a table with each column once, where specimens stand side by side.

    Args:
        table: the readings.
        titles: cells of the line above the headers, which may name the specimens.
    """
    headers, width = table.headers, len(table.headers)
    periods = [p for p in range(2, width // 2 + 1) if width % p == 0]
    period = next((p for p in periods if headers[:p] * (width // p) == headers), 0)
    if not period or not all(headers) or len({*headers[:period]}) < period:
        return table
    starts = range(0, width, period)
    cells = table.grid.read(range(width))
    filled = {
        start: np.any([cells[start + k] != "" for k in range(period)], axis=0)
        for start in starts
    }
    names = [titles[s] or str(s // period + 1) for s in starts]
    labels = np.concatenate(
        [
            np.full(filled[s].sum(), name, object)
            for s, name in zip(starts, names, strict=True)
        ]
    )

    def load(place: int) -> np.ndarray:
        if place == period:
            return labels
        parts = [cells[start + place][filled[start]] for start in starts]
        return np.concatenate([part.astype(object) for part in parts])

    rows = np.concatenate([table.rows[filled[start]] for start in starts])
    grid = ArrayGrid(rows, period + 1, [], load)
    note = f"{len(names)} specimens stand side by side: {', '.join(map(quoted, names))}"
    return replace(
        table,
        headers=(*headers[:period], "specimen"),
        grid=grid,
        filled=len(rows),
        empty=frozenset(),
        notes=(*table.notes, note),
        runs=None,
    )


def joined_sheets(grids: Mapping[str, Grid], findings: FileFindings) -> ReadTable:
    """Return sheets below each other, with a column that names the sheet.

    Args:
        grids: of the sheets, by name.
        findings: of the workbook; gets the sheet and row of each row of the table.

    Raises:
        InputError: their columns differ, or one of them names specimens itself.
    """
    first, tables = next(iter(grids)), {}
    for name, grid in grids.items():
        problems = FileFindings(f"{findings.file}, sheet {quoted(name)}")
        table = table_of(grid, problems)
        findings += problems
        if not table.named:
            findings.refuse(f"sheet {quoted(name)} has no row of headers", "Add one")
        if "specimen" in table.headers:
            words = f"sheet {quoted(name)} names specimens itself"
            findings.refuse(words, "Name that sheet alone")
        tables[name] = table
        if table.headers != tables[first].headers:
            words = f"sheets {quoted(first)} and {quoted(name)} have other columns"
            findings.refuse(words, "Name one sheet, or give them the same headers")
    width = len(tables[first].headers)
    columns = [table.grid.read(range(width)) for table in tables.values()]
    labels = np.concatenate(
        [np.full(len(t.rows), name, object) for name, t in tables.items()]
    )

    def load(place: int) -> np.ndarray:
        parts = [labels] if place == width else [each[place] for each in columns]
        return np.concatenate([part.astype(object) for part in parts])

    begin = first, tables[first].header_row
    rows = [(name, int(row)) for name, table in tables.items() for row in table.rows]
    findings.places = [begin, *rows]
    runs = [table.runs for table in tables.values()]
    blocks = [
        np.zeros(len(table.rows), int) if table.runs is None else table.runs
        for table in tables.values()
    ]
    return ReadTable(
        headers=(*tables[first].headers, "specimen"),
        header_row=1,
        grid=ArrayGrid(np.arange(len(labels)) + 2, width + 1, [], load),
        filled=len(labels),
        notes=(*dict.fromkeys(n for table in tables.values() for n in table.notes),),
        left_out=(*dict.fromkeys(n for t in tables.values() for n in t.left_out),),
        runs=None if all(one is None for one in runs) else np.concatenate(blocks),
    )
