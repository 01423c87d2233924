"""Mechanisms outside the library for the second round: electronics and operation.

Each gives an additive force error of the order of 1 N, with its place, moment or rate
drawn at random. Places are drawn as shares of the stroke and times as shares of a run,
so that a mechanism falls inside the record whatever its size.
"""

import numpy as np
import scipy
from numpy.typing import NDArray

from hdcal.blind.virtual_rig.curves import to_one
from hdcal.blind.virtual_rig.history import Floats, History, last_true


def _load(history: History) -> Floats:
    """Force of the gear as a share of the record's largest."""
    return to_one(history.force)


def _speed(history: History) -> Floats:
    """Speed of the drive, by rows where the clock stands still; 0 as a run starts."""
    moved = np.abs(np.diff(history.deformation, prepend=0.0))
    seconds = history.steps if np.any(history.steps > 0) else np.ones(len(moved))
    timed = (seconds > 0) & ~history.run_starts
    return np.where(timed, moved / np.where(timed, seconds, 1.0), 0.0)


def _misread(history: History, source: NDArray[np.int64]) -> Floats:
    """Error where a row shows the force of another one of the same mounting."""
    same_run = history.run[source] == history.run
    return to_one(np.where(same_run, history.force[source] - history.force, 0.0))


def clipped_below(history: History, rng: np.random.Generator) -> Floats:
    """The converter has one polarity, and shows nothing below its lowest code.

    The amplifier is balanced anew for each mounting, so the lowest readings are cut
    off in some mountings, more or less high, and not in others.
    """
    runs, which = np.unique(history.run, return_inverse=True)
    floors = rng.uniform(-0.2, 0.3, len(runs))
    floors[rng.integers(len(runs))] = rng.uniform(0.15, 0.3)
    return np.maximum(floors[which] - _load(history), 0.0) / 0.2


def inrush_crosstalk(history: History, rng: np.random.Generator) -> Floats:
    """The inrush current of the motor couples into the bridge at each start.

    It fades within some rows, is stronger at a higher speed, and is another one
    when the load helps the motor than when the motor has to lift it.
    """
    speed = _speed(history)
    turned = np.diff(history.sense, prepend=history.sense[0]) != 0
    starts = (speed > 0) & ((np.diff(speed > 0, prepend=False) != 0) | turned)
    since = history.order - last_true(starts | history.run_starts)
    side = np.where(history.sense > 0, 1.0, rng.uniform(-0.4, 0.5))
    fading = np.exp(-since / rng.uniform(1.0, 4.0))
    return to_one(np.sqrt(speed)) * side * fading


def slew_limit(history: History, rng: np.random.Generator) -> Floats:
    """The amplifier's output cannot change faster than at a certain rate.

    Slow strokes are read as they are; in fast ones the reading falls behind farther
    and farther, and catches up after the turn or in a hold.
    """
    seconds = history.steps if np.any(history.steps > 0) else 1.0 - history.run_starts
    change = np.abs(np.diff(history.force, prepend=history.force[0]))
    fastest = np.max(change / np.where(seconds > 0, seconds, np.inf))
    reach = rng.uniform(0.55, 0.9) * fastest * seconds
    shown, starts = history.force.copy(), history.run_starts
    for row in range(1, len(shown)):
        if not starts[row]:
            missing = shown[row] - shown[row - 1]
            shown[row] = shown[row - 1] + np.clip(missing, -reach[row], reach[row])
    return to_one(shown - history.force)


def drooping_hold(history: History, rng: np.random.Generator) -> Floats:
    """The sampled force is held on a capacitor that droops until it is read.

    The longer a row has to wait for its turn, the lower a share of the force is left;
    the next sample is whole again.
    """
    longest = float(np.max(history.steps)) or 1.0
    lost = -np.expm1(-history.steps / (longest * rng.uniform(0.3, 1.5)))
    return -_load(history) * lost


def ground_loop(history: History, rng: np.random.Generator) -> Floats:
    """Current of the running motor returns through the shield of the bridge.

    The zero shifts while the drive moves and is right while it rests; by how much
    depends on how the cable has come to lie at the last turn.
    """
    lies = rng.standard_normal(int(history.half_cycle[-1]) + 1)
    lies *= rng.uniform(0.7, 1.3) / np.max(np.abs(lies))
    return np.where(history.direction != 0, lies[history.half_cycle], 0.0)


def reversed_blocks(history: History, rng: np.random.Generator) -> Floats:
    """For a stretch the buffer of forces is emptied from its wrong end.

    Block by block the forces come in reverse order, beside positions in the right
    one.
    """
    count, size = len(history.order), int(rng.integers(3, 7))
    begin = round(count * rng.uniform(0.05, 0.6))
    end = min(count, begin + max(size, round(count * rng.uniform(0.15, 0.35))))
    source = history.order.copy()
    for first in range(begin, end - size + 1, size):
        source[first : first + size] = source[first : first + size][::-1]
    return _misread(history, source)


def repeated_rows(history: History, rng: np.random.Generator) -> Floats:
    """The bus stalls now and then, and the logger writes the last force again.

    Each time the force stands still for some rows while the position moves on.
    """
    source = history.order.copy()
    for _ in range(rng.integers(5, 11)):
        stalls = int(rng.integers(3, 7))
        first = int(rng.integers(0, max(len(source) - stalls, 1)))
        source[first : first + stalls] = source[first]
    return _misread(history, source)


def bridged_gap(history: History, rng: np.random.Generator) -> Floats:
    """Readings were lost around some turns, and a straight line was put in.

    Whoever filled the gap joined its two ends row by row, so that the tip of the load
    is cut off, or the bottom filled.
    """
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


def tare_under_load(history: History, rng: np.random.Generator) -> Floats:
    """Somebody touches the tare key while the ring is under load.

    The load of that moment is missing from then on, until the display is seen to be
    wrong at the end of the cycle. It happens in some of the cycles.
    """
    curve, load = np.zeros(len(history.order)), _load(history)
    cycles = np.unique(history.cycle)
    touched = rng.random(len(cycles)) < 0.4
    touched[rng.integers(len(cycles))] = True
    for cycle in cycles[touched]:
        rows = np.flatnonzero(history.cycle == cycle)
        first = round(len(rows) * rng.uniform(0.15, 0.7))
        curve[rows[first:]] = -load[rows[min(first, len(rows) - 1)]]
    return curve


def fahrenheit_shift(history: History, rng: np.random.Generator) -> Floats:
    """For one shift the temperature is typed in as degrees Fahrenheit.

    As long as it lasts the compensation of the cell's gain, and in part of its zero,
    is too large by the difference of the two scales.
    """
    part, begin = history.order / len(history.order), rng.uniform(0.1, 0.6)
    here = (part >= begin) & (part < begin + rng.uniform(0.25, 0.4))
    excess = (0.8 * history.temperature + 32.0) / 60.0
    zero = rng.uniform(-0.2, 0.4)
    return here * excess * (zero + (1 - zero) * history.relative_deformation)


def smoothed_record(history: History, rng: np.random.Generator) -> Floats:
    """The forces were smoothed over their neighbours before they were stored.

    On a straight stroke nothing changes, but every tip is rounded off, and every
    bottom too.
    """
    smooth, width = history.force.copy(), rng.uniform(0.8, 3.0)
    for run in np.unique(history.run):
        rows = np.flatnonzero(history.run == run)
        smooth[rows] = scipy.ndimage.gaussian_filter1d(
            history.force[rows], width, mode="nearest"
        )
    return to_one(smooth - history.force)
