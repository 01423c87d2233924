"""Branches of the curve of a run: loading and unloading, and its straight part."""

import math

import numpy as np

from hdcal.screening.channels import HIDDEN
from hdcal.screening.result import (
    HOLDING,
    LOADING,
    MACHINE_CLASS,
    UNLOADING,
    StraightPart,
)
from hdcal.screening.run import Run
from hdcal.screening.straight_pieces import (
    DIGITS,
    SHOWN,
    Straight,
    longest_straight,
    means_of_rows,
)
from hdcal.screening.turning_points import turning_points

_FEWEST = 5  # rows from which on a line has a slope and scatter
# A movement over this share of the range is a branch; from so many on they are cycles,
# of which so many are looked at.
_BRANCH, _CYCLES, _MOST_MOVEMENTS = 0.1, 3, 12
# A run goes to both sides when it goes this share of one way the other way too.
_BOTH_SIDES = 0.5
_HOLD = 3.0  # a hold has so many times as many rows of one reading as a movement
# Movements share a straight part from this share of the longest one on; it is parallel
# where slopes differ by no more than so many standard errors.
_SHARED, _APART = 0.5, 3.0
_LARGE = 0.5  # a movement is large from this share of the largest force on


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
    """Return the longest straight part of a run.

    Of cycles it is the largest movement that is straight as a whole, where at least
    half of them are: a part that yields once goes back and forth along another line.
    Else it is the range that the straight parts of all large movements share, if they
    are parallel there; or else that of the first one, the loading, as testing standards
    have it. In cycles of a loop nothing is straight, and the stiffness is that of all
    of it. Rows that only repeat a reading add nothing.
    """
    rows = one.distinct()
    if rows.size < _FEWEST:
        return None
    turns, _ = _branches(one, rows)
    ends = np.r_[0, turns, rows.size - 1]
    largest = np.argsort(-np.abs(np.diff(one.y[rows[ends]])), kind="stable")
    branches = [rows[ends[i] : ends[i + 1] + 1] for i in largest[:_MOST_MOVEMENTS]]
    found = [longest_straight(one.x[b], one.y[b], one.scatter) for b in branches]
    height = [abs(float(one.y[b[-1]] - one.y[b[0]])) for b in branches]
    large = [i for i, h in enumerate(height) if h >= _LARGE * height[0]]
    shown = [i for i, b in enumerate(branches) if found[i].whole and b.size >= SHOWN]
    if largest.size >= _CYCLES and 2 * len(shown) >= len(branches):
        first = shown[0]
    elif not all(found[i].whole for i in large) and (
        part := _parallel_part(one, [(branches[i], found[i]) for i in large], n)
    ):
        return part
    elif largest.size >= _CYCLES:
        return None
    else:
        first = min(large, key=lambda i: branches[i][0])
    branch, straight = branches[first], found[first]
    part = branch[straight.rows]
    if part.size < _FEWEST or not np.ptp(one.x[part]):
        return None
    slope, sd = _slope(one, part, straight.inflation)
    return _part_of(one, part, n, (slope, sd), whole=all(each.whole for each in found))


def _parallel_part(
    one: Run, movements: list[tuple[np.ndarray, Straight]], n: int
) -> StraightPart | None:
    """Return the range that straight parts of movements share, if they are parallel."""
    if len(movements) < 2 or min(rows.size for rows, _ in movements) < SHOWN:
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
    weight = 1.0 / np.maximum(sds, DIGITS * np.abs(slopes)) ** 2
    slope = float(weight @ slopes / weight.sum())
    unsure = np.maximum(_APART * sds, MACHINE_CLASS * abs(slope))
    if np.any(np.abs(slopes - slope) > unsure):
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
    px, py = means_of_rows(one.x[part]), means_of_rows(one.y[part])
    rows_each = part.size / px.size
    of_means = _line(px, py, one.scatter / math.sqrt(rows_each))[1]
    return slope, max(sd, of_means) * math.sqrt(inflation)


def _branches(one: Run, rows: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the turns of the deformation, or of the force if its gauge trembles."""
    scatter = 10.0 * one.scatter
    for values in (one.x[rows], one.y[rows]):
        least = max(_BRANCH * float(np.ptp(values)), scatter)
        if least <= HIDDEN * float(np.ptp(values)):
            break
        scatter = 0.0
    return turning_points(values, least)


def _line(x: np.ndarray, y: np.ndarray, scatter: float) -> tuple[float, float]:
    """Return a slope and its standard error, corrected for the scatter of x."""
    x, y = x - x.mean(), y - y.mean()
    square = float(x @ x)
    true = max(square - x.size * scatter**2, 0.1 * square)
    slope = float(x @ y) / true
    left = y - slope * x
    sd = np.sqrt(left @ left / max(x.size - 2, 1) * square) / true
    return slope, float(sd)
