"""Grids of cells: every source becomes one before its readings are searched."""

import csv
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd

from hdcal.data.tables.cells import is_number

SEPARATORS = "\t;|,"


class SourceLine(NamedTuple):
    """A row of a source that is no reading, or not yet known to be one.

    Attributes:
        row: its number in the source, 1 = first.
        cells: texts without blanks around them.
        fits: whether it is a row of the grid, as readings are.
    """

    row: int
    cells: list[str]
    fits: bool

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
class Grid(ABC):
    """Rows of cells.

    Attributes:
        rows: row of the source of each, shape (n,), 1 = first.
        width: cells of a row.
        loose: rows of the source with another number of cells.
    """

    rows: np.ndarray
    width: int
    loose: list[SourceLine]

    @abstractmethod
    def read(self, columns: Iterable[int]) -> dict[int, np.ndarray]:
        """Return columns by position, shape (n,) each.

        Floats where every cell is a finite number, else objects: texts without blanks
        around them, or numbers where the source stores numbers.
        """

    @abstractmethod
    def texts(self, column: int) -> list[str]:
        """Return the cells of a column as texts without blanks around them."""

    @abstractmethod
    def take(self, chosen: np.ndarray) -> Self:
        """Return the rows where a mask, shape (n,), is true; none of them is loose."""

    def labels(self, column: int) -> tuple[np.ndarray, list[str]]:
        """Return the index of each cell, shape (n,), and the texts in a column."""
        index, texts = pd.factorize(np.array(self.texts(column), object))
        return index, texts.tolist()

    def is_numeric(self, column: int) -> bool:
        """Tell whether the source itself states that a column holds only numbers."""
        return False

    def has_commas(self) -> bool:
        """Tell whether texts may have decimal commas that `read` takes for such."""
        return False

    def lines(self) -> list[SourceLine]:
        """Return the rows."""
        if not len(self.rows):
            return []
        cells = zip(*map(self.texts, range(self.width)), strict=True)
        rows = zip(self.rows.tolist(), cells, strict=True)
        return [SourceLine(row, [*texts], fits=True) for row, texts in rows]


@dataclass(frozen=True)
class TextGrid(Grid):
    """Lines of a text with as many cells each.

    Attributes:
        separator: character between cells.
        text: the lines.
        quoted: some cells stand in quotation marks.
    """

    separator: str
    text: list[str]
    quoted: bool

    def read(self, columns: Iterable[int]) -> dict[int, np.ndarray]:
        """Return columns by position, shape (n,) each; see `Grid`."""
        wanted = [*columns]
        missing = [place for place in wanted if place not in self._read]
        floats = self._floats(missing)
        for place in missing:
            column = self._floats([place]) if floats is None else floats
            if column is None:
                column = {place: np.array(self.texts(place), object)}
            self._read[place] = column[place]
        return {place: self._read[place] for place in wanted}

    def texts(self, column: int) -> list[str]:
        """Return the cells of a column as texts without blanks around them."""
        mark = self.separator
        if self.quoted:
            return [split_line(line, mark)[column] for line in self.text]
        return [line.split(mark, column + 1)[column].strip() for line in self.text]

    def take(self, chosen: np.ndarray) -> Self:
        """Return the rows where a mask, shape (n,), is true; none of them is loose."""
        if chosen.all() and not self.loose:
            return self
        lines = [*compress(self.text, chosen.tolist())]
        return replace(self, rows=self.rows[chosen], text=lines, loose=[])

    def has_commas(self) -> bool:
        """Tell whether texts may have decimal commas that `read` takes for such."""
        return self.separator != "," and any("," in line for line in self.text)

    def _floats(self, columns: list[int]) -> dict[int, np.ndarray] | None:
        """Return columns if all of their cells are finite numbers."""
        if not self.text or not columns:
            return {place: np.array([], object) for place in columns}
        lines = self.text
        if self.has_commas():
            # Beside decimal commas a point is no part of a number.
            text = "\n".join(lines).replace(".", "?").replace(",", ".")
            lines = text.split("\n")
        try:
            table = np.loadtxt(
                lines,
                delimiter=self.separator,
                usecols=columns,
                comments=None,
                quotechar='"' if self.quoted else None,
                ndmin=2,
            )
        except ValueError:
            return None
        finite = len(table) == len(lines) and np.isfinite(table).all()
        return dict(zip(columns, table.T.copy(), strict=True)) if finite else None

    @cached_property
    def _read(self) -> dict[int, np.ndarray]:
        """Columns that were read already."""
        return {}


@dataclass(frozen=True)
class ArrayGrid(Grid):
    """Columns of arrays.

    Attributes:
        columns: numbers or objects, shape (n,) each.
    """

    columns: Sequence[np.ndarray]

    def read(self, columns: Iterable[int]) -> dict[int, np.ndarray]:
        """Return columns by position, shape (n,) each; see `Grid`."""
        return {place: self._column(place) for place in columns}

    def texts(self, column: int) -> list[str]:
        """Return the cells of a column as texts without blanks around them."""
        index, texts = self.labels(column)
        return np.array(texts, object)[index].tolist()

    def labels(self, column: int) -> tuple[np.ndarray, list[str]]:
        """Return the index of each cell, shape (n,), and the texts in a column."""
        index, cells = pd.factorize(self._column(column))
        return index, [*map(stored_text, cells.tolist())]

    def take(self, chosen: np.ndarray) -> Self:
        """Return the rows where a mask, shape (n,), is true; none of them is loose."""
        columns = [column[chosen] for column in self.columns]
        return replace(self, rows=self.rows[chosen], columns=columns, loose=[])

    def is_numeric(self, column: int) -> bool:
        """Tell whether the source itself states that a column holds only numbers."""
        return self.columns[column].dtype != object

    def _column(self, place: int) -> np.ndarray:
        cells = self.columns[place]
        stored = cells.dtype != object
        if not stored and not all(isinstance(c, float | int) for c in cells.tolist()):
            return cells
        floats = cells.astype(float)
        if np.isfinite(floats).all():
            return floats
        if stored:
            cells = floats.astype(object)
            cells[np.isnan(floats)] = ""
        return cells


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
