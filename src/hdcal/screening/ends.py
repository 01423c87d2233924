"""Beginning and end of a record: rows before the tare, and after the force dropped."""

import numpy as np
from scipy.ndimage import median_filter

from hdcal.screening.local_fit import (
    Usual,
    looked_at,
    median,
    quantile,
    resolution,
    slopes,
    spread,
    windows,
)
from hdcal.screening.turning_points import noise_sd

_REST = 0.01  # share of the tested range within which the deformation counts as at rest
# A gauge is zeroed by a step this many times as large as those of the test.
_ZEROED = 10.0
_EARLY = 0.25  # a tare lies in this share of the first rows at most
# A smaller step of the force, as a share of its range, is left in the record.
_LEAST = 0.02
# The part has given way when the force has fallen by this share of its range; less
# is a serrated yield or the wear of a loop.
_DROP = 0.05
_SMOOTH = 50  # rows on each side that are averaged at most
_GONE = 0.5  # seen in one row only, by so much
# Share of the range that counts as a movement back, and share of a usual step that
# counts as a step on.
_BACK, _ADVANCE = 0.1, 0.25
# A part that gives way after cycles does so by a step of this share of the range and
# of so many usual steps, and stays below what it was at most deformations.
_SHARP, _STEPS, _MOSTLY = 0.3, 20.0, 0.9
_PLACES = 50  # places along the deformation at which before and after are compared
_FEWEST = 5  # rows from which on a curve before the drop can be calibrated


def rows_before_tare(x: np.ndarray, y: np.ndarray) -> tuple[int, float, str]:
    """Return how many first rows were read before the tare, its step and the unit.

    Before a tare nothing moves; then one channel steps while the other one stays.
    """
    last = int(_EARLY * x.size)
    if last < 2:
        return 0, 0.0, ""
    rows = looked_at(x, y)
    rows = rows[rows > 0]
    sample = np.linspace(0, x.size - 1, min(x.size, 100)).astype(int)
    near_x, near_y = (windows(values, sample, np.arange(-5, 5)) for values in (x, y))
    typical = float(median(slopes(near_x, near_y).ravel(), 0.0))
    rise, run = (values[rows] - values[rows - 1] for values in (y, x))
    step = rise - typical * run
    usual = Usual.of(step, resolution(y))
    found = usual.surprised(step, x.size) & (rows >= 2) & (rows <= last)
    found &= np.abs(step) > _LEAST * spread(y)
    # moved by no more than a usual step, or a gauge that is zeroed, by far more
    usual_step = float(quantile(np.abs(run), 0.95))
    far = _ZEROED * usual_step
    near = max(_REST * spread(x), usual_step)
    found &= (np.abs(run) <= near) | (np.abs(run) > far)
    for place in np.flatnonzero(found)[::-1]:
        row = rows[place]
        rests = np.ptp(x[:row]) <= _REST * spread(x)
        if rests and np.ptp(y[:row]) <= 0.2 * abs(step[place]):
            zeroed = abs(run[place]) > far
            size = run[place] if zeroed else step[place]
            return int(row), float(size), "mm" if zeroed else "N"
    return 0, 0.0, ""


def rows_after_drop(x: np.ndarray, y: np.ndarray) -> tuple[int, float] | None:
    """Return the first row after the force has dropped for good, and the drop."""
    start = float(np.median(x[:3]))
    way = 1.0 if x.max() - start >= start - x.min() else -1.0
    x, y = way * (x - start), way * y
    found = _first_loading(x, y) or _later_cycle(x, y)
    return None if found is None else (found[0], way * found[1])


def _later_cycle(x: np.ndarray, y: np.ndarray) -> tuple[int, float] | None:
    """Return where a part gives way after cycles: at once, and everywhere for good.

    The force falls by one step, and stays below all that was read before at the same
    deformation.
    """
    fall = -np.diff(y)
    row, whole = int(np.argmax(fall)) + 1, float(np.ptp(y))
    drop = float(fall[row - 1])
    sharp = drop > max(_SHARP * whole, _STEPS * float(np.median(np.abs(fall))))
    if not sharp or row < 2 * _FEWEST or y.size - row < _FEWEST:
        return None
    # no wild reading
    if np.median(y[row - 3 : row]) - np.median(y[row : row + 3]) < 0.5 * drop:
        return None
    place = np.digitize(x, np.linspace(x.min(), x.max(), _PLACES))
    lowest = np.full(_PLACES + 1, np.inf)
    np.minimum.at(lowest, place[:row], y[:row])
    before = lowest[place[row:]]
    known = np.isfinite(before)
    below = y[row:] < before - 0.5 * _SHARP * whole
    if known.sum() < _FEWEST or np.mean(below[known]) < _MOSTLY:
        return None
    return row, drop


def _first_loading(x: np.ndarray, y: np.ndarray) -> tuple[int, float] | None:
    """Return where the first loading ends in a drop of the force.

    The deformation goes on beyond that of the largest force, and the force does not
    come back. None for a record that never does that, and for one whose deformation
    had gone back and forth before: there the curve is a loop.
    """
    # a peak of noise is no largest force: of means over a few per cent of the record
    half = min(max(1, y.size // 50), _SMOOTH)
    smooth = median_filter(y, 2 * half + 1, mode="nearest")
    peak = int(np.argmax(smooth))
    top = peak + int(np.argmax(y[peak : peak + half + 1]))
    span, whole = float(np.ptp(x)), float(np.ptp(y))
    before = x[: top + 1]
    if top < _FEWEST - 1 or np.ptp(before) < 2.0 * _BACK * span:
        return None
    # moved back and forth before, or not at its farthest at the largest force
    back = np.maximum.accumulate(before) - before
    if back.max() > _BACK * span or back[-1] > 0.5 * _BACK * span:
        return None
    # rows to which the deformation moved on, not those of a hold
    farthest = np.maximum.accumulate(x)
    step = np.median(np.abs(np.diff(before)))
    moved_on = np.diff(farthest, prepend=farthest[0]) > _ADVANCE * step
    fallen = moved_on & (np.arange(x.size) > top)
    # or at rest, where no part lets so much go from one row to the next
    rests = np.abs(np.diff(x[top : top + 2])) <= 0.5 * _BACK * span
    if np.any(rests & (-np.diff(y[top : top + 2]) > _GONE * whole)):
        fallen[top + 1] = True
    if not fallen.any():
        return None
    drop = float(smooth[peak] - np.median(y[fallen]))
    least = _DROP if fallen.sum() > 1 else _GONE
    if drop < max(least * whole, 6.0 * noise_sd(y, fewest=3)):
        return None
    return top + 1, drop
