"""Wild readings: rows that leave the curve while their neighbours keep to it."""

import numpy as np

from hdcal.screening.local_fit import (
    REACH,
    Usual,
    looked_at,
    median,
    quantile,
    residuals,
    resolution,
    slopes,
    windows,
)
from hdcal.screening.result import stretches

# A reading is wild from this many times the steps between the rows about it.
_STEPS = 2.0
_LEAVES = 8.0  # it is this many sd from the sequence of its channel
_LONGEST = 3  # more wild readings in a row are no reading errors
# Before and after them the curve is the same, but for this share of their distance.
_GAP = 0.25
FEWEST = 12  # fewer rows tell nothing of what is usual


def wild_readings(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows that are wild, and their distance from the curve.

    Each row is compared with a robust line through its neighbours, so that several wild
    ones cannot hide each other: on the curve, and in the sequence of one channel.
    """
    if x.size < FEWEST:
        return np.array([], int), np.array([])
    rows = looked_at(x, y)
    order = np.arange(x.size, dtype=float)
    off = residuals(x, y, rows)
    usual = Usual.of(off, resolution(y))
    unusual = usual.surprised(off, x.size)
    if not unusual.any():
        return rows[unusual], off[unusual]
    unusual &= _leaves(order, x, rows) | _leaves(order, y, rows)
    unusual &= np.abs(off) > _STEPS * _step(y, rows)
    found, off = rows[unusual], off[unusual]
    back = _comes_back(x, y, found, off)
    return found[back], off[back]


def _comes_back(
    x: np.ndarray, y: np.ndarray, rows: np.ndarray, off: np.ndarray
) -> np.ndarray:
    """Tell which rows are a short stretch, before and after which the curve is one."""
    good = np.ones(rows.size, bool)
    clean = np.delete(np.arange(x.size), rows)
    for first, last in stretches(rows):
        inside = (rows >= first) & (rows <= last)
        middle = np.searchsorted(clean, first)
        near = clean[max(middle - REACH, 0) : middle + REACH]
        after = near > last
        slope = median(slopes(x[None, near], y[None, near]), 0.0)
        level = y[near] - slope * x[near]
        gap = abs(float(np.median(level[after]) - np.median(level[~after])))
        size = float(np.abs(off[inside]).min())
        good[inside] = last - first < _LONGEST and gap < _GAP * size
    return good


def _leaves(order: np.ndarray, values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    off = residuals(order, values, rows)
    usual = Usual.of(off, resolution(values))
    return np.nan_to_num(np.abs(off)) > _LEAVES * usual.scale


def _step(y: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return a large but usual step of the force near each row."""
    offsets = np.r_[-REACH:0, 2 : REACH + 2]
    steps = windows(np.abs(np.diff(y, prepend=y[0])), rows, offsets)
    return quantile(steps, 0.75)
