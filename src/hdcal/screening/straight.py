"""The longest straight part of a curve."""

from itertools import pairwise

import numpy as np

# The curve is cut into straight pieces between this many points, means of rows.
_POINTS = 120
_PIECES = 6
# A piece has at least this many points, so that it has a slope and scatter.
_FEWEST = 4
# Scatter of a mean, as a share of the distance of two of them.
_FINE = 0.1
# Price of one more piece: a slope, a level and a place.
_PARAMETERS = 3.0


def longest_straight(
    x: np.ndarray, y: np.ndarray, scatter: float = 0.0
) -> tuple[slice, bool]:
    """Return the rows of the longest straight part, and whether it is the whole curve.

    The curve is cut into straight pieces, as many as the Bayesian information
    criterion pays for. The longest one covers the largest area of force and
    deformation together, so that neither an approach without force nor a yield
    without a rise of it counts for much.

    Args:
        x: deformation of one loading, shape (n,).
        y: force, shape (n,).
        scatter: sd of the deformation's reading, which means of rows make small.
    """
    points = min(_POINTS, x.size)
    if scatter:
        fine = _FINE * float(np.ptp(x)) * np.sqrt(x.size) / scatter
        points = min(points, int(fine ** (2.0 / 3.0)))
    if points < 2 * _FEWEST:
        return slice(0, x.size), True
    edges = np.linspace(0, x.size, points + 1).astype(int)
    size = np.diff(edges)
    px, py = (np.add.reduceat(values, edges[:-1]) / size for values in (x, y))
    cost = _costs(px - px.mean(), py - py.mean())
    cuts = _pieces(cost, px.size)
    span_x, span_y = np.ptp(px), np.ptp(py)
    if not span_x or not span_y:
        return slice(0, x.size), True
    areas = [
        abs((px[b - 1] - px[a]) / span_x) * abs((py[b - 1] - py[a]) / span_y)
        for a, b in pairwise(cuts)
    ]
    best = int(np.argmax(areas))
    rows = slice(int(edges[cuts[best]]), int(edges[cuts[best + 1]]))
    return rows, len(cuts) == 2


def _costs(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the squares left by a line through points a … b-1, shape (m+1, m+1)."""
    terms = np.array([np.ones_like(x), x, y, x * x, x * y, y * y])
    sums = np.hstack([np.zeros((6, 1)), np.cumsum(terms, axis=1)])
    n, sx, sy, sxx, sxy, syy = sums[:, None, :] - sums[:, :, None]
    with np.errstate(all="ignore"):
        xx, xy, yy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
        left = yy - np.where(xx > 0.0, xy * xy / xx, 0.0)
    short = n < _FEWEST
    return np.where(short, np.inf, np.maximum(left, 0.0))


def _pieces(cost: np.ndarray, points: int) -> list[int]:
    """Return the edges of the pieces."""
    best = np.full((_PIECES + 1, points + 1), np.inf)
    came = np.zeros((_PIECES + 1, points + 1), int)
    best[0, 0] = 0.0
    for piece in range(1, _PIECES + 1):
        total = best[piece - 1][:, None] + cost
        came[piece] = np.argmin(total, axis=0)
        best[piece] = np.min(total, axis=0)
    left = best[1:, points]
    floor = 1e-8 * cost[0, points] + 1e-300  # digits of the readings
    criterion = points * np.log(np.maximum(left, floor) / points)
    paid = _PARAMETERS * np.arange(1, _PIECES + 1)
    # dearer where few points are left to tell the noise
    criterion += paid * np.log(points) * points / np.maximum(points - paid - 1.0, 1.0)
    count = int(np.argmin(criterion)) + 1
    edges = [points]
    for piece in range(count, 0, -1):
        edges.append(int(came[piece, edges[-1]]))
    return edges[::-1]
