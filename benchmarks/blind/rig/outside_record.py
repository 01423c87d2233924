"""Mechanisms outside the library: display and data logger.

Every public function is one of them, see `outside`.
"""

import numpy as np
import scipy
from numpy.typing import NDArray

from benchmarks.blind.rig.history import Floats, History, to_one


def _misread(history: History, source: NDArray[np.int64]) -> Floats:
    """Error where a row shows the force of another one of the same mounting."""
    same_run = history.run[source] == history.run
    return to_one(np.where(same_run, history.force[source] - history.force, 0.0))


def peak_hold(history: History, rng: np.random.Generator) -> Floats:
    """The display's peak hold is left on for a cycle or two."""
    cycles = np.unique(history.cycle)
    first = cycles[rng.integers(len(cycles))]
    left_on = (history.cycle >= first) & (history.cycle < first + rng.integers(1, 3))
    leak = rng.uniform(0.94, 0.99)
    held, starts = history.force.copy(), history.run_starts
    for row in range(1, len(held)):
        if left_on[row] and left_on[row - 1] and not starts[row]:
            held[row] = max(held[row], leak * held[row - 1])
    return to_one(held - history.force)


def tare_by_cycle(history: History, rng: np.random.Generator) -> Floats:
    """The operator zeroes the display anew before each loading."""
    _, which = np.unique(history.cycle, return_inverse=True)
    return rng.standard_normal(np.max(which) + 1)[which]


def tare_under_load(history: History, rng: np.random.Generator) -> Floats:
    """Somebody touches the tare key while the ring is under load."""
    curve, load = np.zeros(len(history.order)), history.relative_force
    cycles = np.unique(history.cycle)
    touched = rng.random(len(cycles)) < 0.4
    touched[rng.integers(len(cycles))] = True
    for cycle in cycles[touched]:
        rows = np.flatnonzero(history.cycle == cycle)
        first = round(len(rows) * rng.uniform(0.15, 0.7))
        curve[rows[first:]] = -load[rows[min(first, len(rows) - 1)]]
    return curve


def late_channel(history: History, rng: np.random.Generator) -> Floats:
    """For a stretch the logger pairs each position with an earlier force."""
    slip = rng.integers(1, 4)
    earlier = np.maximum(history.order - slip, 0)
    same_run = history.run[earlier] == history.run
    begin = rng.uniform(0.1, 0.6) * len(history.order)
    end = begin + rng.uniform(0.2, 0.35) * len(history.order)
    slipped = (history.order >= begin) & (history.order < end) & same_run
    return to_one(np.where(slipped, history.force[earlier] - history.force, 0.0))


def reversed_blocks(history: History, rng: np.random.Generator) -> Floats:
    """For a stretch the buffer of forces is emptied from its wrong end."""
    count, size = len(history.order), int(rng.integers(3, 7))
    begin = round(count * rng.uniform(0.05, 0.6))
    end = min(count, begin + max(size, round(count * rng.uniform(0.15, 0.35))))
    source = history.order.copy()
    for first in range(begin, end - size + 1, size):
        source[first : first + size] = source[first : first + size][::-1]
    return _misread(history, source)


def repeated_rows(history: History, rng: np.random.Generator) -> Floats:
    """The bus stalls now and then, and the logger writes the last force again."""
    source = history.order.copy()
    for _ in range(rng.integers(5, 11)):
        stalls = int(rng.integers(3, 7))
        first = int(rng.integers(0, max(len(source) - stalls, 1)))
        source[first : first + stalls] = source[first]
    return _misread(history, source)


def bridged_gap(history: History, rng: np.random.Generator) -> Floats:
    """Readings were lost around some turns, and a straight line was put in."""
    filled = history.force.copy()
    turns = np.flatnonzero(np.diff(history.half_cycle, prepend=0) != 0)
    turns = turns[~history.run_starts[turns]]
    few = min(len(turns), int(rng.integers(2, 5)))
    for turn in rng.choice(turns, few, replace=False) if few else ():
        rows = np.flatnonzero(history.run == history.run[turn])
        first = max(turn - rng.integers(3, 10), rows[0])
        last = min(turn + rng.integers(3, 10), rows[-1])
        begin, end = history.force[first], history.force[last]
        filled[first : last + 1] = np.linspace(begin, end, last + 1 - first)
    return to_one(filled - history.force)


def smoothed_record(history: History, rng: np.random.Generator) -> Floats:
    """The forces were smoothed over their neighbours before they were stored."""
    smooth, width = history.force.copy(), rng.uniform(0.8, 3.0)
    for run in np.unique(history.run):
        rows = np.flatnonzero(history.run == run)
        smooth[rows] = scipy.ndimage.gaussian_filter1d(
            history.force[rows], width, mode="nearest"
        )
    return to_one(smooth - history.force)
