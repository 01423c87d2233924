"""The table in a grid, with the units that stand in cells."""

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
    """Return the table in a grid; headers have the units of cells or columns of units.

    A unit that changes from row to row, or differs from the header's, is a finding.
    """
    table = find_table(grid, findings)
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
