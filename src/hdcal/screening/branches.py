"""Branches of the curve of a run: loading and unloading, and its straight part."""

import numpy as np

from hdcal.screening.result import HOLDING, LOADING, UNLOADING, StraightPart
from hdcal.screening.run import Run
from hdcal.screening.straight import longest_straight
from hdcal.screening.trembling import HIDDEN
from hdcal.screening.turning_points import turning_points

# Rows from which on a line has a slope and scatter.
_FEWEST = 5
# A movement over this share of the range is a branch.
_BRANCH = 0.1


def name_segments(one: Run) -> None:
    """Name the rows that are kept by their movement."""
    rows = np.flatnonzero(one.kept)
    if not rows.size:
        return
    turns, sign = _branches(one, rows)
    x = one.x[rows]
    way = 1 if x.max() - x[0] >= x[0] - x.min() else -1
    branch = np.searchsorted(turns, np.arange(rows.size), "left")
    up = sign * way * np.where(branch % 2, -1, 1) >= 0
    one.segment[rows] = np.where(up, LOADING, UNLOADING)
    still = np.diff(x, prepend=np.nan) == 0.0
    one.segment[rows[still]] = HOLDING


def straight_part(one: Run, n: int) -> StraightPart | None:
    """Return the longest straight part of a run's largest movement."""
    rows = np.flatnonzero(one.kept)
    if rows.size < _FEWEST:
        return None
    turns, _ = _branches(one, rows)
    ends = [0, *turns.tolist(), rows.size - 1]
    first = int(np.argmax(np.abs(np.diff(one.y[rows[ends]]))))
    loading = rows[ends[first] : ends[first + 1] + 1]
    found = longest_straight(one.x[loading], one.y[loading], one.scatter)
    part = loading[found[0]]
    if not np.ptp(one.x[part]):
        return None
    low, high = float(one.x[part].min()), float(one.x[part].max())
    inside = np.zeros(n, bool)
    inside[one.rows[one.kept & (one.x >= low) & (one.x <= high)]] = True
    slope, sd = _line(one.x[part], one.y[part], one.scatter)
    return StraightPart(low, high, inside, slope, sd, found[1])


def _branches(one: Run, rows: np.ndarray) -> tuple[np.ndarray, int]:
    """Return where the movement turns, and its first sign, as `turning_points` does.

    Where the gauge of the deformation trembles, the force tells better.
    """
    scatter = 10.0 * one.scatter
    for values in (one.x[rows], one.y[rows]):
        least = max(_BRANCH * float(np.ptp(values)), scatter)
        if least <= HIDDEN * float(np.ptp(values)):
            break
        scatter = 0.0
    return turning_points(values, least)


def _line(x: np.ndarray, y: np.ndarray, scatter: float) -> tuple[float, float]:
    """Return the slope of a line and its standard error.

    Scatter of the deformation, of a known size, is allowed for.
    """
    x, y = x - x.mean(), y - y.mean()
    square = float(x @ x)
    true = max(square - x.size * scatter**2, 0.1 * square)
    slope = float(x @ y) / true
    left = y - slope * x
    sd = np.sqrt(left @ left / max(x.size - 2, 1) * square) / true
    return slope, float(sd)
