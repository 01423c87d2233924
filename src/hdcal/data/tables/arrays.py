"""Grids of arrays: DataFrames, and MATLAB's .mat up to version 7."""

import hashlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.tables.grid import ArrayGrid, SourceLine, stored_text
from hdcal.errors import quoted

# What findings call a table in memory.
NAME = "DataFrame"
_FEWEST = 5


def frame_grid(frame: pd.DataFrame, first: int = 2) -> ArrayGrid:
    """Return the grid of a DataFrame below a row of its names.

    Columns that are only counted have no headers: they are asked for by number.

    Args:
        frame: the readings.
        first: number of its first row.
    """
    names = [str(name) for name in frame.columns]
    counted = all(name.isdigit() for name in names)
    header = [] if counted else [SourceLine(first - 1, names, fits=True)]
    rows = np.arange(len(frame)) + (first - 1 if counted else first)
    columns = [_plain_column(frame.iloc[:, i]) for i in range(len(names))]
    return ArrayGrid(rows, len(columns), header, columns)


def memory_grid(data: Any, findings: FileFindings) -> tuple[ArrayGrid, str]:
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
    grid = frame_grid(frame)
    digest = hashlib.sha256("\t".join(map(str, frame.columns)).encode())
    for column in grid.columns:
        if column.dtype == object:
            digest.update("\n".join(map(stored_text, column.tolist())).encode())
        else:
            digest.update(column.tobytes())
    return grid, digest.hexdigest()


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
        return frame_grid(pd.DataFrame(dict(taken))), [note] if left else []
    matrices = [(name, array) for name, array in arrays if array.ndim == 2]
    if not usual and len(matrices) == 1:
        name, matrix = matrices[0]
        note = f"the matrix {quoted(name)} holds the readings"
        return frame_grid(pd.DataFrame(matrix)), [note]
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
