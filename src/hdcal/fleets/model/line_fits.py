"""Straight line, loop and bend of each gear on each rig, by least squares from sums.

A mounting holds sums of products of v = (x, sense, x|x|, y) about its mean. All lines
of a gear on a rig have one slope and a zero for each mounting. The loop is the force
of loading above unloading. The bend is how far the middle of the curve lies below the
chord of its ends: it is positive where the gear stiffens.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hdcal.fleets.reading.readings import MountingSums

# Square of a term beside the terms before it, relative to its whole square, below
# which the readings do not determine its size.
_COLLINEAR = 0.02
# Degrees of freedom that must be left beside line, loop and bend.
_LEAST_FREE = 4.0
# Relative square that rounding of floating-point numbers leaves.
_ROUNDING = 1e-12
# Pooled correlation of neighbours that is taken into account: larger than this, and
# than so many standard errors.
_LEAST_CORRELATION, _CLEAR, _MOST_CORRELATION = 0.2, 4.0, 0.99


@dataclass(frozen=True)
class LineFits:
    """One entry for each gear, ascending, on each rig on which it moved.

    Errors are variances / σ², widened for the correlation of neighbours.

    Attributes:
        slope: [N/mm as read].
        loop: [N], as the bend; NaN where it is not known.
        freedom: degrees of freedom of the noise of each gear, shape (g,).
        log_sd: logarithm of the residual sd of each gear [N], shape (g,).
        correlation: of neighbouring residuals, pooled; 0 where it is not clear.
    """

    gear: np.ndarray
    rig: np.ndarray
    slope: np.ndarray
    slope_error: np.ndarray
    loop: np.ndarray
    loop_error: np.ndarray
    bend: np.ndarray
    bend_error: np.ndarray
    freedom: np.ndarray
    log_sd: np.ndarray
    correlation: float

    @property
    def widening(self) -> float:
        """Factor of variances due to the correlation of neighbours."""
        return (1.0 + self.correlation) / (1.0 - self.correlation)


def line_fits(sums: MountingSums, rig: np.ndarray, step: float = 0.0) -> LineFits:
    """Fit one curve for each gear and rig; `rig` is the rig index of each mounting.

    Readings on an exact line scatter by the step of the force display [N].
    """
    rigs, gears = 1 + int(rig.max()), 1 + int(sums.gear.max())
    pairs, pair = np.unique(sums.gear * rigs + rig, return_inverse=True)
    gear, of_rig = np.divmod(pairs, rigs)
    products, lagged = (
        _summed(each, pair, len(pairs)) for each in (sums.products, sums.lagged)
    )
    free = np.bincount(pair, sums.rows - 1.0)
    loop_first = fit_terms(products, (0, 1, 2), free)
    bend_first = fit_terms(products, (0, 2, 1), free)
    squares = np.maximum(loop_first.squares(products), 0.0)
    freedom, square = (
        np.bincount(gear, values, gears)
        for values in (free - loop_first.known.sum(axis=1), squares)
    )
    exact = square <= _ROUNDING * np.bincount(gear, products[:, 3, 3], gears)
    square = np.where(exact, freedom * step**2 / 12.0, square)
    known = (freedom > 0.0) & (square > 0.0)
    variance = np.where(known, square, 1.0) / np.where(known, freedom, 1.0)
    follow = loop_first.squares(lagged) / variance[gear]
    correlation = _correlation(follow[known[gear]], freedom[known])
    wider = (1.0 + correlation) / (1.0 - correlation)
    moved, swing = loop_first.known[:, 0], _swing(sums)
    return LineFits(
        gear=gear[moved],
        rig=of_rig[moved],
        slope=loop_first.size[moved, 0],
        slope_error=wider * loop_first.error[moved, 0],
        # The sense is ±1: a loop is twice its coefficient.
        loop=2.0 * bend_first.size[moved, 2],
        loop_error=4.0 * wider * bend_first.error[moved, 2],
        bend=swing * loop_first.size[moved, 2],
        bend_error=swing**2 * wider * loop_first.error[moved, 2],
        freedom=np.where(known, freedom, 0.0) / wider,
        log_sd=0.5 * np.log(variance),
        correlation=correlation,
    )


class TermFits(NamedTuple):
    """Coefficients of three terms of p curves, each beside those before it, (p, 3).

    With their variance over σ², whether the readings determine them, and the residual
    as a combination of v, (p, 4).
    """

    size: np.ndarray
    error: np.ndarray
    known: np.ndarray
    residual: np.ndarray

    def squares(self, products: np.ndarray) -> np.ndarray:
        """Return the sum of squares of residuals, or of another product, shape (p,)."""
        return _quadratic(products, self.residual, self.residual)


def fit_terms(
    products: np.ndarray, order: tuple[int, ...], free: np.ndarray
) -> TermFits:
    """Fit x, sense and x|x|, by their places in v, each to what those before it leave.

    The slope comes first: it is that of the straight line alone. Products of v have the
    shape (p, 4, 4), the degrees of freedom before the fit (p,).
    """
    count = len(products)
    size, error = np.full((2, count, 3), np.nan)
    known = np.zeros((count, 3), bool)
    terms: list[np.ndarray] = []
    residual = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    for place, column in enumerate(order):
        term = np.zeros((count, 4))
        term[:, column] = 1.0
        for before, earlier in enumerate(terms):
            share = _quadratic(products, earlier, term) * error[:, before]
            term -= np.where(known[:, before], share, 0.0)[:, None] * earlier
        square, whole = _quadratic(products, term, term), products[:, column, column]
        enough = free - known.sum(axis=1) > (_LEAST_FREE if place else 0.0)
        clear = (square > _COLLINEAR * whole) & (whole > 0.0) & enough
        known[:, place] = clear
        error[clear, place] = 1.0 / square[clear]
        pull = _quadratic(products, term, residual)
        size[clear, place] = pull[clear] / square[clear]
        residual -= np.where(clear, size[:, place], 0.0)[:, None] * term
        terms.append(term)
    return TermFits(size, error, known, residual)


def _quadratic(products: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.einsum("pi,pij,pj->p", left, products, right)


def _summed(parts: np.ndarray, index: np.ndarray, count: int) -> np.ndarray:
    found = np.zeros((count, *parts.shape[1:]))
    np.add.at(found, index, parts)
    return found


def _correlation(follow: np.ndarray, freedom: np.ndarray) -> float:
    """Return the pooled correlation of neighbours from sums of products, if clear."""
    whole = max(float(freedom.sum()), 1.0)
    found = min(float(follow.sum()) / whole, _MOST_CORRELATION)
    return found if found > max(_LEAST_CORRELATION, _CLEAR / np.sqrt(whole)) else 0.0


def _swing(sums: MountingSums) -> float:
    """Return how far x|x| is off its chord in the middle of a usual range [mm²]."""
    # A range L that is passed evenly has the variance L²/12.
    squared = np.minimum(12.0 * sums.products[:, 0, 0] / sums.rows, sums.reach**2)
    return float(np.median(squared)) / 4.0
