"""Row buckets: few array lengths, so that few executables serve data of every size.

JAX compiles one executable for each shape of its arguments: rows are padded to one of
a few lengths. In sums over rows `measured` leaves padding out.
"""

from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from hdcal.data.records import Array, Records

Tree = TypeVar("Tree")

_SMALLEST = 16


def bucket_size(rows: int) -> int:
    """Return the padded length, 2ᵏ or 3 · 2ᵏ, of so many rows."""
    power = _SMALLEST
    while power < rows:
        power *= 2
    between = 3 * power // 4
    return between if power > _SMALLEST and rows <= between else power


def repeat_last_row(tree: Tree, size: int) -> Tree:
    """Return arrays with a common first axis, padded with copies of the last row.

    For records: a load that is held changes nothing in the rows before it.
    """

    def padded(array) -> np.ndarray:
        array = np.asarray(array)
        width = [(0, size - len(array)), *[(0, 0)] * (array.ndim - 1)]
        return np.pad(array, width, "edge")

    return jax.tree.map(padded, tree)


def pad_records(records: Records) -> Records:
    """Return records padded to the size of their bucket."""
    return repeat_last_row(records, bucket_size(len(records.force)))


def measured(size: int, count) -> Bool[Array, " n"]:
    """Return which of `size` padded rows were measured; serves inside `jax.jit`."""
    return jnp.arange(size) < count
