"""Grids of cells: every source becomes one before its readings are searched."""

import csv
import hashlib
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.tables.cells import is_number

SEPARATORS = "\t;|,"


class SourceLine(NamedTuple):
    """A row of a source that is no reading, or not yet known to be one."""

    row: int  # 1 = first
    cells: list[str]  # without blanks around them
    fits: bool  # whether it is a row of the grid, as readings are

    @property
    def first(self) -> str:
        """First cell that is not empty."""
        return next(filter(None, self.cells), "")

    @property
    def numbers(self) -> int:
        """Number of cells that are numbers."""
        return sum(map(is_number, self.cells))

    @property
    def counts(self) -> bool:
        """Whether it begins as a number or a time does."""
        return self.first.lstrip("+-.,")[:1].isdigit()


@dataclass(frozen=True)
class Grid:
    """Rows of cells.

    A column, shape (n,), holds floats, NaN for an empty cell, where the source states
    that it holds numbers; else texts on one line and stored numbers.
    """

    rows: np.ndarray  # of the source, shape (n,), 1 = first
    columns: list[np.ndarray]
    loose: tuple[SourceLine, ...] = ()  # with another number of cells
    separator: str = ""  # between the cells of a text

    @property
    def width(self) -> int:
        """Number of cells of a row."""
        return len(self.columns)

    def read(self, place: int) -> np.ndarray:
        """Return a column: finite floats, else texts and stored numbers, shape (n,)."""
        cells = self.columns[place]
        if cells.dtype == object:
            stored = all(isinstance(cell, float | int) for cell in cells.tolist())
            return cells.astype(float) if stored and len(cells) else cells
        if np.isfinite(cells).all():
            return cells
        return np.where(np.isnan(cells), "", cells.astype(object))

    def texts(self, place: int) -> list[str]:
        """Return the cells of a column as texts."""
        index, texts = self.labels(place)
        return np.array(texts, object)[index].tolist()

    def labels(self, place: int) -> tuple[np.ndarray, list[str]]:
        """Return the index of each cell, shape (n,), and the texts in a column."""
        index, cells = pd.factorize(self.read(place))
        return index, [*map(stored_text, cells.tolist())]

    def is_numeric(self, place: int) -> bool:
        """Tell whether the source itself states that a column holds only numbers."""
        return self.columns[place].dtype != object

    def take(self, chosen: np.ndarray) -> "Grid":
        """Return the rows where a mask, shape (n,), is true; none of them is loose."""
        columns = [column[chosen] for column in self.columns]
        return replace(self, rows=self.rows[chosen], columns=columns, loose=())

    def lines(self) -> list[SourceLine]:
        """Return the rows."""
        cells = zip(*map(self.texts, range(self.width)), strict=True)
        rows = zip(self.rows.tolist(), cells, strict=False)
        return [SourceLine(row, [*texts], fits=True) for row, texts in rows]


def stored_text(cell: Any) -> str:
    """Return a cell as text: a number in full, on one line."""
    if cell is None or cell != cell:
        return ""
    if isinstance(cell, float):
        return str(int(cell)) if cell.is_integer() and abs(cell) < 1e15 else repr(cell)
    return " ".join(str(cell).split())


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of a line without blanks around them."""
    cells = line.split(separator)
    if '"' in line:
        with suppress(csv.Error):  # a cell longer than the csv module will hold
            cells = next(csv.reader([line], delimiter=separator), [])
    return [cell.strip() for cell in cells]


def frame_grid(frame: pd.DataFrame, first: int = 2) -> Grid:
    """Return the grid of a DataFrame whose first row has a number."""
    names = [str(name) for name in frame.columns]
    # Columns that are only counted have no headers: they are asked for by number.
    counted = all(name.isdigit() for name in names)
    header = () if counted else (SourceLine(first - 1, names, fits=True),)
    rows = np.arange(len(frame)) + (first - 1 if counted else first)
    columns = [_plain_column(frame.iloc[:, i]) for i in range(len(names))]
    return Grid(rows, columns, header)


def memory_grid(data: Any, findings: FileFindings) -> tuple[Grid, str]:
    """Return the grid of a table in memory, and the hash of its cells."""
    if hasattr(data, "to_pandas"):
        data = data.to_pandas()
    try:
        frame = pd.DataFrame(data)
    except (ValueError, TypeError) as error:
        remedy = "Give arrays of one length and one dimension, by name"
        findings.refuse(f"is not a table ({error})", remedy)
    if frame.columns.nlevels > 1:
        remedy = "Give each column one name, as in frame.columns.map('_'.join)"
        findings.refuse("has columns of several levels", remedy)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    text = frame.to_csv(index=False)
    return frame_grid(frame), hashlib.sha256(text.encode()).hexdigest()


def _plain_column(column: pd.Series) -> np.ndarray:
    """Return a column of a DataFrame as `Grid` holds it."""
    types = pd.api.types
    if types.is_numeric_dtype(column) and not types.is_bool_dtype(column):
        return column.to_numpy(float, na_value=np.nan)
    if isinstance(column.dtype, pd.CategoricalDtype):
        cells = _plain_column(column.cat.categories.to_series())
        # The code of an empty cell is -1.
        return np.append(cells.astype(object), "")[column.cat.codes]
    objects = column.astype(object).where(column.notna(), "").to_numpy()
    cells = [
        c if isinstance(c, int | float) and not isinstance(c, bool) else stored_text(c)
        for c in objects
    ]
    return np.array(cells, object)
