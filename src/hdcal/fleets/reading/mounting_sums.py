"""Sums over the readings of each mounting: all that the model of a fleet needs."""

from dataclasses import dataclass, fields, replace
from typing import NamedTuple, Self

import numpy as np


class RowSums(NamedTuple):
    """Sums over sets of rows, of the vector v of every row.

    Attributes:
        rows: number of rows, shape (p,).
        mean: of v, shape (p, 4).
        products: sum of (v − mean)(v − mean)ᵀ, shape (p, 4, 4).
        lagged: sum of (v_t − mean)(v_{t−1} − mean)ᵀ over rows that follow another one
            of the set, shape (p, 4, 4).
        first: v of the first row, shape (p, 4).
        last: v of the last row, shape (p, 4).
        low: smallest deformation as read, shape (p,) [mm].
        high: largest one.
    """

    rows: np.ndarray
    mean: np.ndarray
    products: np.ndarray
    lagged: np.ndarray
    first: np.ndarray
    last: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, v: np.ndarray, deformation: np.ndarray) -> Self:
        """Sum rows in the order in which they were taken.

        Args:
            index: of the set of each row, 0, 1, … without a gap, shape (n,).
            v: of each row, shape (4, n).
            deformation: as read, shape (n,) [mm].
        """
        order = np.argsort(index, kind="stable")
        rows = np.bincount(index)
        start = np.cumsum(rows) - rows
        v, read = v[:, order], deformation[order]
        mean = np.add.reduceat(v, start, axis=1) / rows
        about = v - np.repeat(mean, rows, axis=1)
        before = np.zeros_like(about)
        before[:, 1:] = about[:, :-1]
        before[:, start] = 0.0
        return cls(
            rows.astype(float),
            mean.T,
            _product_sums(about, about, start),
            _product_sums(about, before, start),
            v[:, start].T,
            v[:, start + rows - 1].T,
            np.minimum.reduceat(read, start),
            np.maximum.reduceat(read, start),
        )

    def joined(self, index: np.ndarray) -> "RowSums":
        """Return the sums of wholes whose parts these are, in the order of the rows.

        Args:
            index: of the whole of each part, 0, 1, … without a gap, shape (p,).
        """
        order = np.argsort(index, kind="stable")
        parts = RowSums(*(column[order] for column in self))
        whole = index[order]
        start = np.searchsorted(whole, np.arange(1 + whole.max()))
        end = np.append(start[1:], len(whole)) - 1
        rows = np.add.reduceat(parts.rows, start)
        mean = np.add.reduceat(parts.rows[:, None] * parts.mean, start) / rows[:, None]
        middle = mean[whole]
        shift = parts.mean - middle
        products = parts.products + parts.rows[:, None, None] * _outer(shift, shift)
        # Without the first row of a part its rows have another mean; likewise the last.
        first, last = parts.first - middle, parts.last - middle
        lagged = (
            parts.lagged
            + (parts.rows[:, None, None] + 1.0) * _outer(shift, shift)
            - _outer(first, shift)
            - _outer(shift, last)
        )
        # The first row of a part follows the last one of the part before.
        follows = np.ones(len(whole), bool)
        follows[start] = False
        lagged[follows] += _outer(first[follows], last[np.flatnonzero(follows) - 1])
        return RowSums(
            rows,
            mean,
            np.add.reduceat(products, start),
            np.add.reduceat(lagged, start),
            parts.first[start],
            parts.last[end],
            np.minimum.reduceat(parts.low, start),
            np.maximum.reduceat(parts.high, start),
        )


def _product_sums(one: np.ndarray, other: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the sums of one[i] other[j] from each start on, shape (p, 4, 4)."""
    sums = np.empty((len(start), len(one), len(other)))
    for i, left in enumerate(one):
        for j, right in enumerate(other):
            sums[:, i, j] = np.add.reduceat(left * right, start)
    return sums


def _outer(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, :, None] * other[:, None, :]


def reading_vectors(x: np.ndarray, sense: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return v = (x, sense, x|x|, y) of each row, shape (4, n).

    Args:
        x: deformation as read times the modulus that is left, shape (n,) [mm].
        sense: of the last movement, shape (n,).
        force: shape (n,) [N].
    """
    return np.stack([x, sense, x * np.abs(x), force])


@dataclass(frozen=True)
class MountingSums:
    """Sums over the readings of every mounting, in the order of the gears.

    Attributes:
        gear: index of the gear, shape (m,).
        run: index of the run, shape (m,).
        rows: number of readings, shape (m,).
        mean: of v = (x, sense, x|x|, y), shape (m, 4): the deformation x as read times
            the modulus over that at the reference temperature [mm], the sense of the
            movement (1 loading, −1 unloading), and the force y [N].
        products: sum of (v − mean)(v − mean)ᵀ, shape (m, 4, 4).
        lagged: sum of (v_t − mean)(v_{t−1} − mean)ᵀ over successive readings.
        reach: largest deformation, without its sign, shape (m,) [mm].
    """

    gear: np.ndarray
    run: np.ndarray
    rows: np.ndarray
    mean: np.ndarray
    products: np.ndarray
    lagged: np.ndarray
    reach: np.ndarray

    def where(self, kept: np.ndarray) -> "MountingSums":
        """Return the mountings that are true in a mask, shape (m,)."""
        return MountingSums(*(getattr(self, each.name)[kept] for each in fields(self)))

    def stretched(self, factor: np.ndarray) -> "MountingSums":
        """Return sums as if x were longer by a factor of each mounting, shape (m,)."""
        one = np.ones(len(factor))
        scale = np.stack([factor, one, factor * np.abs(factor), one], axis=1)
        return replace(
            self,
            mean=scale * self.mean,
            products=_outer(scale, scale) * self.products,
            lagged=_outer(scale, scale) * self.lagged,
            reach=np.abs(factor) * self.reach,
        )
