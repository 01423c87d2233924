"""The straight pieces of one movement, and the longest of them."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hdcal.screening.local_fit import RESOLVED
from hdcal.screening.turning_points import noise_sd

SHOWN = 20  # rows of a movement that show whether it is straight
# The curve is cut into straight pieces between this many points, means of rows.
_POINTS = 120
_PIECES = 6
# A piece within the curve has at least this many points, so that it has a slope and
# scatter; the first and the last may be shorter, as a preload or a tare is.
_FEWEST_POINTS = 4
_PARAMETERS = 3.0  # price of one more piece: a slope, a level and a place
# Share of a piece that is left out where it meets another one: the place of a cut is
# known to some points only, and a curve that bends gradually has none.
_MARGIN = 0.1
# Share of the readings that is no more than rounding of what was computed.
DIGITS = 1e-9
# Points that distinguish correlated noise from a kink: ten for each piece.
_FEWEST_FOR_MEMORY = 10 * _PIECES


class Straight(NamedTuple):
    """The longest straight part of a movement."""

    rows: slice  # of the movement
    whole: bool  # whether it is the whole curve
    inflation: float = 1.0  # of the variance of its slope, by correlated neighbours


def longest_straight(x: np.ndarray, y: np.ndarray, scatter: float = 0.0) -> Straight:
    """Return the longest straight part of a movement.

    The curve is cut into straight pieces, as many as the Bayesian information
    criterion pays for. The longest one covers the largest area of force and
    deformation together, so that neither an approach without force nor a yield
    without a rise of it counts for much.
    """
    if x.size < 2 * _FEWEST_POINTS:
        return Straight(slice(0, x.size), True)
    edges = _edges_of(x.size)
    px, py = _means(x, edges), _means(y, edges)
    span_x, span_y = np.ptp(px), np.ptp(py)
    if not span_x or not span_y:
        return Straight(slice(0, x.size), True)
    sx, sy = px - px.mean(), py - py.mean()
    if scatter:
        noise = max(noise_sd(y, fewest=3), RESOLVED * float(span_y))
        sx, sy = sx / scatter, sy / noise
    cuts, inflation = _pieces(sx, sy, both=scatter > 0.0)
    areas = [
        abs((px[b - 1] - px[a]) / span_x) * abs((py[b - 1] - py[a]) / span_y)
        for a, b in pairwise(cuts)
    ]
    best = int(np.argmax(areas))
    first, last = int(edges[cuts[best]]), int(edges[cuts[best + 1]])
    margin = int(_MARGIN * (last - first))
    inner = slice(
        first + (margin if first > 0 else 0), last - (margin if last < x.size else 0)
    )
    return Straight(inner, len(cuts) == 2, inflation)


def _edges_of(rows: int) -> np.ndarray:
    """Return where rows are parted into so many means, or as many as there are."""
    return np.linspace(0, rows, min(_POINTS, rows) + 1).astype(int)


def means_of_rows(values: np.ndarray) -> np.ndarray:
    """Return means of rows, as many as pieces are made of, or as there are rows."""
    return _means(values, _edges_of(values.size))


def _means(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.add.reduceat(values, edges[:-1]) / np.diff(edges)


def _costs(x: np.ndarray, y: np.ndarray, *, both: bool) -> np.ndarray:
    """Return the squares left by a line through points a … b-1, shape (m+1, m+1)."""
    terms = np.array([np.ones_like(x), x, y, x * x, x * y, y * y])
    sums = np.hstack([np.zeros((6, 1)), np.cumsum(terms, axis=1)])
    n, sx, sy, sxx, sxy, syy = sums[:, None, :] - sums[:, :, None]
    with np.errstate(all="ignore"):
        xx, xy, yy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
        left = yy - np.where(xx > 0.0, xy * xy / xx, 0.0)
        if both:
            left = 0.5 * (xx + yy - np.hypot(xx - yy, 2.0 * xy))
    short = n < _FEWEST_POINTS
    short[0, 1:], short[1:-1, -1] = False, n[1:-1, -1] < 1
    return np.where(short, np.inf, np.maximum(left, 0.0))


def _pieces(x: np.ndarray, y: np.ndarray, *, both: bool) -> tuple[list[int], float]:
    """Return the edges of the pieces, and how much correlation widens variances.

    What the most pieces leave is noise; neighbours that err alike count for less.
    """
    cost, points = _costs(x, y, both=both), x.size
    best = np.full((_PIECES + 1, points + 1), np.inf)
    came = np.zeros((_PIECES + 1, points + 1), int)
    best[0, 0] = 0.0
    for piece in range(1, _PIECES + 1):
        total = best[piece - 1][:, None] + cost
        came[piece] = np.argmin(total, axis=0)
        best[piece] = np.min(total, axis=0)
    inflation = _inflation(x, y, _edges(came, points, _PIECES), both=both)
    left = best[1:, points]
    floor = 1e-8 * cost[0, points] + 1e-300  # digits of the readings
    worth = points / inflation
    criterion = worth * np.log(np.maximum(left, floor) / points)
    paid = _PARAMETERS * np.arange(1, _PIECES + 1)
    # dearer where few points are left to tell the noise
    criterion += paid * np.log(points) * points / np.maximum(points - paid - 1.0, 1.0)
    chosen = _edges(came, points, int(np.argmin(criterion)) + 1)
    # Fewer pieces follow less of the noise, and show more of its correlation.
    return chosen, _inflation(x, y, chosen, both=both)


def _edges(came: np.ndarray, points: int, count: int) -> list[int]:
    """Return the edges of so many pieces, from where each best one began."""
    edges = [points]
    for piece in range(count, 0, -1):
        edges.append(int(came[piece, edges[-1]]))
    return edges[::-1]


def _inflation(x: np.ndarray, y: np.ndarray, edges: list[int], *, both: bool) -> float:
    """Return (1 + r) / (1 - r) of the neighbours' correlation r, if it is positive."""
    if x.size < _FEWEST_FOR_MEMORY:
        return 1.0
    pieces = [(a, b) for a, b in pairwise(edges) if b > a]
    left = np.concatenate([_left(x[a:b], y[a:b], both=both) for a, b in pieces])
    square = float(left @ left)
    if square <= DIGITS**2 * float(x @ x + y @ y):
        return 1.0
    r = float(left[1:] @ left[:-1]) / square
    # Two parameters a piece make the residuals of independent noise alternate.
    r += 2.0 * len(pieces) / x.size
    r = min(max(r, 0.0), 1.0 - 1.0 / x.size)
    return (1.0 + r) / (1.0 - r)


def _left(x: np.ndarray, y: np.ndarray, *, both: bool) -> np.ndarray:
    """Return what a line leaves of some points; across it where both scatter."""
    x, y = x - x.mean(), y - y.mean()
    square = float(x @ x)
    if both:
        angle = 0.5 * np.arctan2(2.0 * (x @ y), square - y @ y)
        return y * np.cos(angle) - x * np.sin(angle)
    return y - x * (float(x @ y) / square) if square else y
