"""Places at which a zero may have jumped: a channel leaves its own sequence."""

import numpy as np

from hdcal.screening.local_fit import (
    REACH,
    Usual,
    looked_at,
    median,
    resolution,
    windows,
)
from hdcal.screening.turning_points import noise_sd

# Rows needed on each side of a jump; from fewer it could be anything.
SIDE = 4
# A smaller jump, as a share of the tested range, is left to the model's noise.
LEAST = 0.02
# A window moves one way when this share of its way is progress, and rests when it
# covers less than the second share of what windows usually do.
_PROGRESS, _RESTS = 0.6, 0.25
# Any other step about a jump is at most this share of it.
_OTHERS = 0.5
_NEAR = np.r_[1 - REACH : 0, 1:REACH]


def possible_jumps(x: np.ndarray, y: np.ndarray, scatter: float) -> np.ndarray:
    """Return rows before which a zero may have jumped, the clearest first."""
    rows = looked_at(x, y)
    rows = rows[(rows >= SIDE) & (rows <= x.size - SIDE)]
    if rows.size < 2 * SIDE:
        return rows[:0]
    (off_x, far_x), (off_y, far_y) = _off(x, rows), _off(y, rows)
    possible = _one_way(x, rows, scatter)
    if scatter:
        # The force tells the way too, and trembles less.
        possible |= _one_way(y, rows, noise_sd(y))
    found = (off_x | off_y) & possible
    clearest = np.argsort(-np.maximum(far_x, far_y))
    return rows[clearest[found[clearest]]]


def off_sequence(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Tell before which rows a channel steps as it does nowhere else about them."""
    return _off(values, rows)[0]


def _off(values: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    steps = values[rows] - values[rows - 1]
    near = windows(np.diff(values, prepend=values[0]), rows, _NEAR)
    level = median(near)
    off = steps - level
    usual = Usual.of(off, resolution(values))
    with np.errstate(all="ignore"):
        others = np.nanmax(np.abs(near - level[:, None]), axis=1)
    alone = others <= _OTHERS * np.abs(off)
    return usual.surprised(off, values.size) & alone, np.abs(off) / usual.scale


def _one_way(values: np.ndarray, rows: np.ndarray, scatter: float) -> np.ndarray:
    """Tell where a channel moves the same way before and after a row, or rests."""
    sides = [windows(values, rows, o) for o in (np.arange(-REACH, 0), np.arange(REACH))]
    with np.errstate(all="ignore"):
        reach = [np.nanmax(each, axis=1) - np.nanmin(each, axis=1) for each in sides]
    rests = [each < _RESTS * np.median(np.hstack(reach)) for each in reach]
    ways = []
    for each, still in zip(sides, rests, strict=True):
        steps = np.diff(each, axis=1)
        way, path = np.nansum(steps, axis=1), np.nansum(np.abs(steps), axis=1)
        # steps of a gauge that trembles, 2/√π of its sd each
        shaken = 1.13 * scatter * np.sum(np.isfinite(steps), axis=1)
        moves = np.abs(way) >= _PROGRESS * (path - shaken)
        ways.append(np.where(still, 0.0, np.where(moves, way, np.nan)))
    return ~np.isnan(ways[0] + ways[1]) & (ways[0] * ways[1] >= 0.0)
