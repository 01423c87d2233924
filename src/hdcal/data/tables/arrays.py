"""Grids of arrays: DataFrames, columns of Arrow, and MATLAB's .mat up to version 7."""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.tables.grid import ArrayGrid, SourceLine, stored_text
from hdcal.errors import quoted

if TYPE_CHECKING:
    from pyarrow import Schema

# What findings call a table in memory.
NAME = "DataFrame"
_FEWEST = 5


def _array_grid(names: Sequence[str], columns: Sequence[np.ndarray]) -> ArrayGrid:
    """Return a grid of columns, shape (n,) each, below a row of their names.

    Columns that are only counted have no headers: they are asked for by number.
    """
    rows = np.arange(len(columns[0]) if columns else 0)
    counted = all(name.isdigit() for name in names)
    header = [] if counted else [SourceLine(1, [*names], fits=True)]
    numeric = frozenset(i for i, one in enumerate(columns) if one.dtype.kind in "iuf")
    first = 1 if counted else 2
    return ArrayGrid(rows + first, len(columns), header, columns.__getitem__, numeric)


def frame_grid(data: Any, findings: FileFindings) -> tuple[ArrayGrid, str]:
    """Return the grid of a table in memory, and the hash of its cells.

    Raises:
        InputError: arrays of several lengths, or of more than one dimension; headers
            of several levels.
    """
    if hasattr(data, "to_pandas"):
        data = data.to_pandas()
    try:
        frame = pd.DataFrame(data)
    except (ValueError, TypeError) as error:
        remedy = "Give arrays of one length and one dimension, by name"
        findings.refuse(f"is no table ({error})", remedy)
    if frame.columns.nlevels > 1:
        remedy = "Name each by one text, as in frame.columns.map('_'.join)"
        findings.refuse("has columns of several levels", remedy)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    names = [str(name) for name in frame.columns]
    columns = [_plain_column(frame.iloc[:, i]) for i in range(len(names))]
    digest = hashlib.sha256("\t".join(names).encode())
    for column in columns:
        if column.dtype == object:
            digest.update("\n".join(map(stored_text, column.tolist())).encode())
        else:
            digest.update(column.tobytes())
    return _array_grid(names, columns), digest.hexdigest()


def arrow_grid(
    schema: "Schema",
    arrow: Callable[[str], Any],
    rows: int,
    first: int,
    *,
    days: bool = False,
) -> ArrayGrid:
    """Return a grid of columns of Arrow, each loaded when it is needed.

    Args:
        schema: of the columns; nested ones are no cells.
        arrow: returns a column by its name.
        rows: their number.
        first: number of the first one.
        days: whether of times the day alone is read, in their own time zone.
    """
    from pyarrow import types

    plain = [field for field in schema if not types.is_nested(field.type)]
    kinds = [field.type for field in plain]
    numeric = frozenset(
        place
        for place, kind in enumerate(kinds)
        if types.is_integer(kind) or types.is_floating(kind)
    )

    def load(place: int) -> np.ndarray:
        kind, cells = kinds[place], arrow(plain[place].name)
        if days and types.is_timestamp(kind):
            times = cells.to_pandas().dt.tz_localize(None)
            return _plain_column(times.dt.normalize().astype("category"))
        if place not in numeric and not types.is_dictionary(kind):
            cells = cells.dictionary_encode()
        return _plain_column(cells.to_pandas())

    header = SourceLine(first - 1, [field.name for field in plain], fits=True)
    return ArrayGrid(np.arange(rows) + first, len(plain), [header], load, numeric)


def _plain_column(column: pd.Series) -> np.ndarray:
    """Return a column of a DataFrame as numbers, or as objects: texts and numbers."""
    types = pd.api.types
    if types.is_numeric_dtype(column) and not types.is_bool_dtype(column):
        return column.to_numpy(float, na_value=np.nan)
    if isinstance(column.dtype, pd.CategoricalDtype):
        cells = _plain_column(column.cat.categories.to_series())
        # The code of an empty cell is -1.
        return np.append(cells.astype(object), "")[column.cat.codes]
    objects = column.astype(object).where(column.notna(), "").to_numpy()
    kinds = str, int, float
    cells = [c if isinstance(c, kinds) and c is not True else str(c) for c in objects]
    return np.array(cells, object)


def mat_grid(path: Path, findings: FileFindings) -> tuple[ArrayGrid, list[str]]:
    """Return the vectors of one length in a .mat file, or the columns of a matrix.

    Raises:
        InputError: it holds no one table.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(path, simplify_cells=True)
    except Exception as error:  # whatever a parser makes of a broken file
        words = f"is no .mat file that can be read ({error})"
        findings.refuse(words, "Save it anew")
    arrays = [*_arrays(content)]
    lengths = Counter(len(array) for _, array in arrays if array.ndim == 1)
    usual = [size for size, many in lengths.items() if many > 1]
    taken = [(n, a) for n, a in arrays if a.ndim == 1 and [len(a)] == usual]
    if taken and len({name for name, _ in taken}) == len(taken):
        left = [name for name, array in arrays if [len(array)] != usual]
        note = f"not read of the file: {', '.join(map(quoted, left))}"
        names, vectors = zip(*taken, strict=True)
        return _array_grid(names, vectors), [note] if left else []
    matrices = [(name, array) for name, array in arrays if array.ndim == 2]
    if not usual and len(matrices) == 1:
        name, matrix = matrices[0]
        names = [str(k + 1) for k in range(matrix.shape[1])]
        note = f"the matrix {quoted(name)} holds the readings"
        return _array_grid(names, [*matrix.T]), [note]
    held = ", ".join(quoted(name) for name, _ in arrays) or "no arrays"
    words = f"holds no one table of readings: {held}"
    findings.refuse(words, "Save vectors of one length, each under one name")


def _arrays(content: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of numbers in variables and structures, by name."""
    if isinstance(content, dict):
        for key, value in content.items():
            if not key.startswith("__"):
                yield from _arrays(value, key)
    elif isinstance(content, np.ndarray) and content.dtype.kind in "iuf":
        yield from [(name, content)] if content.size >= _FEWEST else []
