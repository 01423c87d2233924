"""Branches of the curve of a run: loading and unloading, and its straight part."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hdcal.screening.channels import HIDDEN
from hdcal.screening.local_fit import RESOLVED
from hdcal.screening.result import HOLDING, LOADING, UNLOADING, StraightPart
from hdcal.screening.run import Run
from hdcal.screening.turning_points import noise_sd, turning_points

# Rows from which on a line has a slope and scatter.
_FEWEST = 5
# A movement over this share of the range is a branch; from so many on they are cycles,
# of which so many are looked at.
_BRANCH, _CYCLES, _MOST_MOVEMENTS = 0.1, 3, 12
# A run goes to both sides when it goes this share of one way the other way too.
_BOTH_SIDES = 0.5
# A hold has so many times as many rows of one reading as a movement.
_HOLD = 3.0
# Movements share a straight part from this share of the longest one on; it is parallel
# where slopes differ by no more than so many standard errors, or by this share.
_SHARED, _APART, _ALIKE = 0.5, 3.0, 0.005
# A movement is large from this share of the largest force on.
_LARGE = 0.5


def name_segments(one: Run) -> None:
    """Name the rows that are kept by their movement."""
    rows = np.flatnonzero(one.kept)
    if not rows.size:
        return
    turns, sign = _branches(one, rows)
    x = one.x[rows]
    # Loading is to the side on which the run goes farther; where it goes to both, up.
    above, below = x.max() - x[0], x[0] - x.min()
    way = -1 if above < _BOTH_SIDES * below else 1
    branch = np.searchsorted(turns, np.arange(rows.size), "left")
    up = sign * way * np.where(branch % 2, -1, 1) >= 0
    one.segment[rows] = np.where(up, LOADING, UNLOADING)
    still = np.diff(x, prepend=np.nan) == 0.0
    # A coarse gauge repeats readings; a hold lasts for longer than it usually does.
    starts = np.flatnonzero(~still)
    length = np.diff(np.r_[starts, rows.size])
    holds = length > _HOLD * np.median(length)
    still &= np.repeat(holds, length)
    one.segment[rows[still]] = HOLDING


def straight_part(one: Run, n: int) -> StraightPart | None:
    """Return the longest straight part of a run's first large movement.

    That is the loading, as testing standards have it. Of cycles it is the largest
    movement that is straight as a whole, where at least half of them are: a part that
    yields once goes back and forth along another line. Where they are not, but are
    parallel over a range that they share, it is that range of all of them. In a loop
    none is straight, and the stiffness is that of all of it. Rows that only repeat a
    reading add nothing.
    """
    rows = one.distinct()
    if rows.size < _FEWEST:
        return None
    turns, _ = _branches(one, rows)
    ends = np.r_[0, turns, rows.size - 1]
    largest = np.argsort(-np.abs(np.diff(one.y[rows[ends]])), kind="stable")
    branches = [rows[ends[i] : ends[i + 1] + 1] for i in largest[:_MOST_MOVEMENTS]]
    found = [longest_straight(one.x[b], one.y[b], one.scatter) for b in branches]
    pairs = list(zip(branches, found, strict=True))
    height = [abs(float(one.y[b[-1]] - one.y[b[0]])) for b in branches]
    large = [i for i, h in enumerate(height) if h >= _LARGE * height[0]]
    if largest.size >= _CYCLES:
        pairs = [(b, s) for b, s in pairs if s.whole and b.size >= _SHOWN]
        if 2 * len(pairs) < len(branches):
            return _parallel_part(one, [(branches[i], found[i]) for i in large], n)
    else:
        pairs = [pairs[min(large, key=lambda i: branches[i][0])]]
    branch, straight = pairs[0]
    part = branch[straight.rows]
    if not np.ptp(one.x[part]):
        return None
    slope, sd = _slope(one, part, straight.inflation)
    return _part_of(one, part, n, (slope, sd), whole=all(each.whole for each in found))


def _parallel_part(
    one: Run, movements: list[tuple[np.ndarray, "Straight"]], n: int
) -> StraightPart | None:
    """Return the range that straight parts of movements share, if they are parallel."""
    if min(rows.size for rows, _ in movements) < _SHOWN:
        return None
    # Of a gauge that trembles a range of readings is no range of the deformation.
    place = one.y if one.scatter else one.x
    ends = [place[rows[straight.rows]] for rows, straight in movements]
    low, high = max(e.min() for e in ends), min(e.max() for e in ends)
    if high - low < _SHARED * max(float(np.ptp(e)) for e in ends):
        return None
    parts = [
        rows[(place[rows] >= low) & (place[rows] <= high)] for rows, _ in movements
    ]
    if min(part.size for part in parts) < _FEWEST:
        return None
    inflations = [straight.inflation for _, straight in movements]
    slopes, sds = np.transpose(
        [_slope(one, part, wide) for part, wide in zip(parts, inflations, strict=True)]
    )
    weight = 1.0 / np.maximum(sds, 1e-300) ** 2
    slope = float(weight @ slopes / weight.sum())
    if np.any(np.abs(slopes - slope) > np.maximum(_APART * sds, _ALIKE * abs(slope))):
        return None
    rows = one.distinct()
    rows = rows[(place[rows] >= low) & (place[rows] <= high)]
    return _part_of(one, rows, n, (slope, float(weight.sum() ** -0.5)), whole=False)


def _part_of(
    one: Run, part: np.ndarray, n: int, line: tuple[float, float], *, whole: bool
) -> StraightPart:
    """Return rows of a run with the slope of their line and its standard error."""
    inside = np.zeros(n, bool)
    inside[one.rows[one.with_repeats(part)]] = True
    low, high = float(one.x[part].min()), float(one.x[part].max())
    return StraightPart(low, high, inside, *line, whole)


def _slope(one: Run, part: np.ndarray, inflation: float) -> tuple[float, float]:
    """Return the slope of some rows of a movement and its standard error.

    Neighbours err alike: of means of rows, beyond which the memory is small.
    """
    slope, sd = _line(one.x[part], one.y[part], one.scatter)
    px, py = (_means(values[part], _edges_of(part.size)) for values in (one.x, one.y))
    rows_each = part.size / px.size
    of_means = _line(px, py, one.scatter / math.sqrt(rows_each))[1]
    return slope, max(sd, of_means) * math.sqrt(inflation)


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


# Rows of a movement from which on it is seen whether it is straight.
_SHOWN = 20
# The curve is cut into straight pieces between this many points, means of rows.
_POINTS = 120
_PIECES = 6
# A piece within the curve has at least this many points, so that it has a slope and
# scatter; the first and the last may be shorter, as a preload or a tare is.
_FEWEST_POINTS = 4
# Price of one more piece: a slope, a level and a place.
_PARAMETERS = 3.0
# Share of a piece that is left out where it meets another one: the place of a cut is
# known to some points only, and a curve that bends gradually has none.
_MARGIN = 0.1
# Points from which on noise that remembers can be told from a kink: ten for each piece.
_FEWEST_FOR_MEMORY = 10 * _PIECES


class Straight(NamedTuple):
    """The longest straight part of a movement.

    Attributes:
        rows: of the movement.
        whole: whether it is the whole curve.
        inflation: of the variance of its slope, by the correlation of neighbours.
    """

    rows: slice
    whole: bool
    inflation: float = 1.0


def longest_straight(x: np.ndarray, y: np.ndarray, scatter: float = 0.0) -> Straight:
    """Return the longest straight part of a movement.

    The curve is cut into straight pieces, as many as the Bayesian information
    criterion pays for. The longest one covers the largest area of force and
    deformation together, so that neither an approach without force nor a yield
    without a rise of it counts for much.

    Args:
        x: deformation of one loading, shape (n,).
        y: force, shape (n,).
        scatter: sd of the deformation's reading. Lines then lie nearest to the points
            in the noises of both channels.
    """
    points = min(_POINTS, x.size)
    if points < 2 * _FEWEST_POINTS:
        return Straight(slice(0, x.size), True)
    edges = _edges_of(x.size, points)
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


def _edges_of(rows: int, points: int = _POINTS) -> np.ndarray:
    """Return where rows are parted into so many means, or as many as there are."""
    points = min(points, rows)
    return np.linspace(0, rows, points + 1).astype(int)


def _means(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.add.reduceat(values, edges[:-1]) / np.diff(edges)


def _costs(x: np.ndarray, y: np.ndarray, *, both: bool) -> np.ndarray:
    """Return the squares left by a line through points a … b-1, shape (m+1, m+1).

    Args:
        x: shape (m,).
        y: shape (m,).
        both: whether both scatter by the same: squares are across the line then.
    """
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
    # Fewer pieces follow less of the noise, and leave more of its memory to be seen.
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
    r = float(left[1:] @ left[:-1]) / square if square else 0.0
    # Two parameters a piece make the residuals of independent noise alternate.
    r += 2.0 * len(pieces) / x.size
    r = min(max(r, 0.0), 1.0 - 1.0 / x.size)
    return (1.0 + r) / (1.0 - r)


def _left(x: np.ndarray, y: np.ndarray, *, both: bool) -> np.ndarray:
    """Return what a line leaves of some points; across it where both scatter."""
    x, y = x - x.mean(), y - y.mean()
    if both:
        across = np.linalg.svd(np.column_stack([x, y]), full_matrices=True)[2][1]
        return across[0] * x + across[1] * y
    square = float(x @ x)
    return y - x * (float(x @ y) / square) if square else y
