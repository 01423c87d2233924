"""A channel that is held at its extreme while the other one goes on."""

import numpy as np

from hdcal.screening.turning_points import turning_points

# Digits are finer than this share of the range, or a value repeats by itself.
_DIGITS = 2e-3
# Readings of the very same value in a row.
_FEWEST = 5
# Share of its range by which the other channel has to move meanwhile.
_MOVES = 0.1
# It has to go on at least at this share of its pace before.
_PACE = 0.5


def saturated_rows(held: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """Return rows at which a channel stands at its largest or smallest reading.

    Args:
        held: the channel that may be saturated, shape (n,).
        moving: the other one, shape (n,).
    """
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
        if stop - first < _FEWEST or first < _FEWEST:
            continue
        before = slice(max(first - (stop - first), 0), first + 1)
        pace = np.median(np.abs(np.diff(moving[before])))
        goes_on = np.median(np.abs(np.diff(moving[first:stop]))) >= _PACE * pace > 0.0
        # in the way in which the held channel rose, so that it should rise on
        way = np.sign(np.polyfit(held[before], moving[before], 1)[0])
        beyond = np.max(way * (moving[first:stop] - moving[first]))
        if goes_on and beyond >= _MOVES * np.ptp(moving):
            found[first:stop] = True
    return found
