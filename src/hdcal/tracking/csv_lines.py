"""Readings as lines of CSV: a header row once, then one reading a line."""

from typing import Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.cells import CellError, read_number
from hdcal.data.tables.columns import choose_columns
from hdcal.data.tables.grid import split_line
from hdcal.data.tables.headers import LABELS
from hdcal.data.tables.named_columns import Column
from hdcal.data.tables.shapes import table_of
from hdcal.data.tables.text import text_grid
from hdcal.errors import InputError

# What a tracker takes of a reading.
_TAKEN = ("deformation", "force", "temperature", "time", "run")


class CsvLines:
    """Reads the lines below a header row, whose headers are those of files.

    Args:
        header: the header row.

    Raises:
        InputError: it does not say which columns are deformation and force.
    """

    def __init__(self, header: str):
        grid, _ = text_grid(header)
        with FileFindings("standard input") as wrong:
            table = table_of(grid, wrong)
            self._columns: dict[str, Column] = choose_columns(
                table, {}, _TAKEN, _TAKEN[:2], wrong
            )
        self._separator, self._width = grid.separator, grid.width
        # One decimal sign serves a whole stream, once a comma was one.
        self._comma = False

    def read(self, line: str) -> dict[str, Any]:
        """Return the arguments of `Tracker.update` from a line.

        Raises:
            ValueError: it holds no reading.
        """
        cells = split_line(line, self._separator)
        if len(cells) != self._width:
            raise ValueError(f"{len(cells)} cells where the header has {self._width}")
        found: dict[str, Any] = {}
        for quantity, column in self._columns.items():
            cell = cells[column.position]
            if quantity in LABELS:
                found[quantity] = cell
                continue
            self._comma |= self._separator != "," and "," in cell
            try:
                number = np.array([read_number(cell, self._comma)])
            except CellError as error:
                raise ValueError(f"{quantity}: {error.args[0]}") from None
            assert column.unit is not None
            found[quantity] = float(column.unit.convert(number)[0])
        return found


def csv_lines(header: bytes) -> CsvLines | None:
    """Return the reader of a stream that begins with a header row, else None."""
    try:
        text = header.decode("utf-8-sig").strip()
        return None if text.startswith("{") else CsvLines(text)
    except (UnicodeDecodeError, InputError):
        return None
