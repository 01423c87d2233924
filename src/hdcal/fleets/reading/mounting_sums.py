"""Sums over the readings of each mounting: all that the model of a fleet needs."""

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np


@dataclass(frozen=True)
class RowSums:
    """Sums over p sets of rows, of the vector v = (x, sense, x|x|, y) of every row.

    x is the deformation as read times the modulus that is left [mm], the sense that of
    the movement (1 loading, −1 unloading), y the force [N].

    Attributes:
        rows: number of rows, shape (p,).
        mean: of v, shape (p, 4).
        products: sum of (v − mean)(v − mean)ᵀ, shape (p, 4, 4).
        lagged: sum of (v_t − mean)(v_{t−1} − mean)ᵀ over successive rows.
        low: smallest deformation, shape (p,) [mm].
        high: largest one.
    """

    rows: np.ndarray
    mean: np.ndarray
    products: np.ndarray
    lagged: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, v: np.ndarray, deformation: np.ndarray) -> "RowSums":
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
        products, lagged = np.empty((2, len(rows), len(v), len(v)))
        for i, row in enumerate(about):
            for j in range(len(v)):
                products[:, i, j] = np.add.reduceat(row * about[j], start)
                lagged[:, i, j] = np.add.reduceat(row * before[j], start)
        low, high = np.minimum.reduceat(read, start), np.maximum.reduceat(read, start)
        return RowSums(rows.astype(float), mean.T, products, lagged, low, high)

    @property
    def reach(self) -> np.ndarray:
        """Largest deformation without its sign, shape (p,) [mm]."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    def where(self, kept: np.ndarray) -> Self:
        """Return some sets, by a mask or by indices."""
        return type(self)(*(getattr(self, each.name)[kept] for each in fields(self)))

    def joined(self, index: np.ndarray) -> "RowSums":
        """Return the sums of wholes whose parts these are, in the order of the rows.

        Pairs of successive rows of different parts are left out of `lagged`.

        Args:
            index: of the whole of each part, 0, 1, … without a gap, shape (p,).
        """
        order = np.argsort(index, kind="stable")
        parts, whole = self.where(order), index[order]
        start = np.searchsorted(whole, np.arange(1 + whole.max()))
        rows, each = np.add.reduceat(parts.rows, start), parts.rows[:, None]
        mean = np.add.reduceat(each * parts.mean, start) / rows[:, None]
        shift = parts.mean - mean[whole]
        between = each[..., None] * _outer(shift, shift)
        return RowSums(
            rows,
            mean,
            np.add.reduceat(parts.products + between, start),
            np.add.reduceat(parts.lagged + between, start),
            np.minimum.reduceat(parts.low, start),
            np.maximum.reduceat(parts.high, start),
        )

    def stretched(self, factor: np.ndarray) -> Self:
        """Return sums as if x were longer by a factor of each set, shape (p,)."""
        one = np.ones(len(factor))
        scale = np.stack([factor, one, factor * np.abs(factor), one], axis=1)
        return replace(
            self,
            mean=scale * self.mean,
            products=_outer(scale, scale) * self.products,
            lagged=_outer(scale, scale) * self.lagged,
            low=factor * self.low,
            high=factor * self.high,
        )


@dataclass(frozen=True)
class MountingSums(RowSums):
    """Sums of every mounting, with the index of its gear, ascending, and of its run."""

    gear: np.ndarray
    run: np.ndarray


def _outer(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, :, None] * other[:, None, :]


def reading_vectors(x: np.ndarray, sense: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return v of each row, shape (4, n)."""
    return np.stack([x, sense, x * np.abs(x), force])
