"""Sheets of the same columns as one table, each of them a specimen."""

from collections.abc import Mapping

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.grid import ArrayGrid, Grid
from hdcal.data.tables.shapes import table_of
from hdcal.errors import quoted


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
