"""Grids of Arrow's columns: a Parquet file, or a batch of its rows."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.grid import ArrayGrid, SourceLine, stored_text

if TYPE_CHECKING:
    from pyarrow import Schema

# What a Parquet file begins with.
PARQUET = b"PAR1"


@dataclass(frozen=True)
class ArrowGrid(ArrayGrid):
    """Columns of Arrow, each loaded when it is needed.

    Attributes:
        arrow: returns a column as Arrow's array.
        days: of times in labels the day is read, as clocks there showed it.
    """

    arrow: Callable[[int], Any] = lambda place: None
    days: bool = False

    def texts(self, column: int) -> list[str]:
        """As in `Grid`."""
        index, names = self.labels(column)
        return [names[one] for one in index.tolist()]

    def labels(self, column: int) -> tuple[np.ndarray, list[str]]:
        """As in `Grid`."""
        from pyarrow import compute, types

        cells = self.arrow(column)
        cells = cells if self.index is None else cells.take(self.index)
        # Functions that no stubs know of.
        known: Any = compute
        if types.is_timestamp(cells.type) and self.days:
            cells = known.local_timestamp(cells) if cells.type.tz is not None else cells
            cells = known.floor_temporal(cells, unit="day")
        if not types.is_dictionary(cells.type):
            cells = known.dictionary_encode(cells, null_encoding="encode")
        names = [stored_text(cell) for cell in cells.dictionary.to_pylist()]
        index = cells.indices.fill_null(len(names)).to_numpy(zero_copy_only=False)
        return index, [*names, ""]


def arrow_grid(
    schema: "Schema",
    arrow: Callable[[str], Any],
    rows: int,
    first: int,
    days: bool = False,
) -> ArrowGrid:
    """Return a grid of columns of Arrow.

    Args:
        schema: of the columns; nested ones are no cells.
        arrow: returns a column by its name.
        rows: how many there are.
        first: what the first one is called.
        days: as in `ArrowGrid`.
    """
    from pyarrow import types

    plain = [field for field in schema if not types.is_nested(field.type)]
    kinds = types.is_integer, types.is_floating
    numeric = [i for i, one in enumerate(plain) if any(k(one.type) for k in kinds)]

    def load(place: int) -> np.ndarray:
        column = arrow(plain[place].name)
        if place in numeric:
            return column.to_numpy(zero_copy_only=False).astype(float, copy=False)
        cells = (_plain(cell) for cell in column.to_pylist())
        return np.fromiter(cells, object, len(column))

    return ArrowGrid(
        rows=np.arange(rows) + first,
        width=len(plain),
        loose=[SourceLine(first - 1, [field.name for field in plain], fits=True)],
        load=load,
        numeric=frozenset(numeric),
        arrow=lambda place: arrow(plain[place].name),
        days=days,
    )


def parquet_grid(path: Path, findings: FileFindings) -> tuple[ArrowGrid, list[str]]:
    """Return the grid of a Parquet file.

    Raises:
        InputError: it is none, or pyarrow is missing.
    """
    try:
        from pyarrow import parquet
    except ImportError:
        words = "is a Parquet file, which needs pyarrow"
        findings.refuse(words, 'pip install "hdcal[files]"')
    try:
        file = parquet.ParquetFile(path, memory_map=True)
        schema, rows = file.schema_arrow, file.metadata.num_rows
    except Exception as error:  # whatever a parser makes of a broken file
        words = f"is no Parquet file that can be read ({error})"
        findings.refuse(words, "Save it anew")

    def column(name: str) -> Any:
        return file.read([name], use_threads=False).column(0).combine_chunks()

    return arrow_grid(schema, column, rows, 2), []


def _plain(cell: Any) -> Any:
    """Return a cell of Arrow as a number or a text."""
    number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return cell if number else stored_text(cell)
