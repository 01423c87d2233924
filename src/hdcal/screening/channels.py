"""Single channels: saturation, a stuck channel, and a gauge that trembles."""

from typing import Any

import numpy as np
from scipy.stats import norm, wilcoxon

from hdcal.screening.turning_points import turning_points

# Digits are finer than this share of the range, or a value repeats by itself.
_DIGITS = 2e-3
_FEWEST_HELD = 5  # readings of the very same value in a row
_MOVES = 0.1  # share of its range by which the other channel has to move meanwhile
_PACE = 0.5  # it has to go on at least at this share of its pace before


def saturated_rows(held: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """Return rows at which a channel stands at its largest or smallest reading."""
    steps = np.diff(np.unique(held))
    if not steps.size or np.min(steps) > _DIGITS * np.ptp(held):
        return np.array([], int)
    found = [_plateau(way * held, moving) for way in (1.0, -1.0)]
    return np.flatnonzero(found[0] | found[1])


def _plateau(held: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """Return which rows at the largest reading belong to plateaus."""
    at_extreme = held == held.max()
    found = np.zeros(at_extreme.size, bool)
    # one that swings to and fro, as a part that was let go, reads no limit
    turns, _ = turning_points(moving, _MOVES * float(np.ptp(moving)))
    if at_extreme[turns].sum() > 1:
        return found
    edges = np.flatnonzero(np.diff(np.r_[False, at_extreme, False].astype(int)))
    for first, stop in edges.reshape(-1, 2):
        if stop - first < _FEWEST_HELD or first < _FEWEST_HELD:
            continue
        before = slice(max(first - (stop - first), 0), first + 1)
        pace = np.median(np.abs(np.diff(moving[before])))
        goes_on = np.median(np.abs(np.diff(moving[first:stop]))) >= _PACE * pace > 0.0
        # in the way in which the held channel rose, so that it should rise on
        way = np.sign(np.polyfit(held[before], moving[before], 1)[0])
        beyond = np.quantile(way * (moving[first:stop] - moving[first]), 0.9)
        if goes_on and beyond >= _MOVES * np.ptp(moving):
            found[first:stop] = True
    return found


def longest_stuck(
    held: np.ndarray, moving: np.ndarray, run: np.ndarray, *, display: bool
) -> int:
    """Return the most equal readings in a row while the other channel moves on, or 0.

    A coarse display repeats readings where the curve is flat, which counts as stuck
    unless `display`. In a hold the other channel may creep, more slowly than before.
    """
    steps, span = np.diff(np.unique(held)), np.ptp(held)
    if not len(steps):
        return 0
    multiples = steps / steps.min()
    coarse = np.allclose(multiples, multiples.round(), rtol=0.0, atol=1e-3)
    if display and coarse and steps.min() > _DIGITS * span:
        return 0
    step = np.abs(np.diff(moving))
    pace = _PACE * np.median(step[np.diff(run) == 0])
    # Equal readings of a display differ by less than one of its steps.
    least = max(_MOVES, 2.0 * steps.min() / span) * np.ptp(moving)
    begins = np.r_[True, (np.diff(held) != 0.0) | (np.diff(run) != 0)]
    longest = 0
    for rows in np.split(np.arange(len(held)), np.flatnonzero(begins)[1:]):
        if len(rows) >= _FEWEST_HELD and (
            np.ptp(moving[rows]) > least and np.median(step[rows[:-1]]) > pace
        ):
            longest = max(longest, len(rows))
    return longest


_BLOCKS = 12  # rows that are averaged into one, to see the slope without the scatter
_FEWEST_ROWS = 40
_MOST_PARTS = 100_000  # so many second differences tell whether there is scatter
_LEVEL = 1e-4  # probability of a false alarm in a record without scatter
# The scatter matters when it bends a straight line by more than this share.
_MATTERS = 1e-3
# Least correlation, with the other sign, of second differences with the next ones.
_ALTERNATES = 0.3
# Turning points are hidden when ten sd of the scatter are more than this share of
# the range: the largest reversal that noise may hide.
HIDDEN = 0.2


def scatter_of_deformation(x: np.ndarray, y: np.ndarray) -> float:
    """Return the sd of the deformation's reading; 0 where none shows.

    A movement that is really uneven has the force follow it; scatter of the gauge
    does not. Of the second differences the part that the force does not follow is
    the gauge's.
    """
    if x.size < _FEWEST_ROWS:
        return 0.0
    slope = _slope(x, y)
    bend_x, bend_y = np.diff(x, 2), np.diff(y, 2)
    if slope == 0.0 or not bend_x.any():
        return 0.0
    # with wild readings and jumps left out
    limit = 8.0 * np.median(np.abs(bend_x)) + 1e-300
    usual = np.abs(bend_x) <= limit
    bend_x, bend_y = bend_x[usual], bend_y[usual]
    parts = bend_x * (bend_x - bend_y / slope) / 6.0
    variance = float(parts.mean())
    if variance <= 0.0:
        return 0.0
    # Without scatter the parts lie about zero. Neighbouring second differences share
    # readings: half of them are independent.
    some = parts[:: -(-parts.size // _MOST_PARTS)]
    found: Any = wilcoxon(some, alternative="greater", method="asymptotic")
    clear = float(found.zstatistic) > np.sqrt(2.0) * norm.isf(_LEVEL)
    # of scatter they alternate (-2/3), of a smooth movement they do not
    alternates = np.mean(bend_x[1:] * bend_x[:-1]) < -_ALTERNATES * np.mean(bend_x**2)
    return float(np.sqrt(variance)) if clear and alternates else 0.0


def matters(scatter: float, x: np.ndarray) -> bool:
    """Tell whether scatter makes a straight line too flat."""
    return scatter**2 > _MATTERS * float(np.var(x))


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Return the slope between block means, which scatter hardly touches."""
    blocks = [np.array_split(values, _BLOCKS) for values in (x, y)]
    means = [np.array([block.mean() for block in each]) for each in blocks]
    order = np.argsort(means[1])
    low, high = order[: _BLOCKS // 3], order[-(_BLOCKS // 3) :]
    run, rise = (float(m[high].mean() - m[low].mean()) for m in means)
    return rise / run if run else 0.0
