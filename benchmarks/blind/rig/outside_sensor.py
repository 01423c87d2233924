"""Mechanisms outside the library: sensors and electronics.

Every public function is one of them, see `outside`.
"""

import numpy as np

from benchmarks.blind.rig.history import (
    Floats,
    History,
    bell,
    last_true,
    latched,
    to_one,
)


def _speed(history: History) -> Floats:
    """Speed of the drive, per row where no time passes; 0 as a run starts."""
    moved = np.abs(np.diff(history.deformation, prepend=0.0))
    seconds = history.steps if np.any(history.steps > 0) else np.ones(len(moved))
    timed = (seconds > 0) & ~history.run_starts
    return np.where(timed, moved / np.where(timed, seconds, 1.0), 0.0)


def hum(history: History, rng: np.random.Generator) -> Floats:
    """Mains pick-up, folded down by slow sampling to a period of a few rows."""
    steps = history.steps[history.steps > 0]
    by_time = rng.random() < 0.5 and len(steps) > 0
    clock = history.time / np.median(steps) if by_time else history.order
    period = np.exp(rng.uniform(np.log(2.3), np.log(15.0)))
    return np.sin(2 * np.pi * (clock / period + rng.random()))


def random_walk(history: History, rng: np.random.Generator) -> Floats:
    """The zero wanders: each row adds a small independent shift to the last."""
    count = len(history.order)
    return np.cumsum(rng.standard_normal(count)) / np.sqrt(count)


def loose_connector(history: History, rng: np.random.Generator) -> Floats:
    """A plug makes contact in one of two ways and hops between them."""
    hops = rng.random(len(history.order)) < 1 / rng.uniform(4.0, 15.0)
    return (np.cumsum(hops) % 2).astype(float)


def uneven_bits(history: History, rng: np.random.Generator) -> Floats:
    """The converter's resistors are off, so each upper bit weighs a little wrong."""
    eighths = 8 * np.abs(history.relative_force) / rng.uniform(1.02, 1.5)
    code = np.floor(eighths).astype(int)
    bits = (code[:, None] >> np.array([2, 1, 0])) & 1
    # Neighbours of one sign would be little but a wrong gain.
    wrong = rng.uniform(0.4, 1.0, 3) * np.array([1, -1, rng.choice([-1, 1])])
    return bits @ wrong


def clipped_below(history: History, rng: np.random.Generator) -> Floats:
    """The converter has one polarity, and shows nothing below its lowest code."""
    runs, which = np.unique(history.run, return_inverse=True)
    floors = rng.uniform(-0.2, 0.3, len(runs))
    floors[rng.integers(len(runs))] = rng.uniform(0.15, 0.3)
    return np.maximum(floors[which] - history.relative_force, 0.0) / 0.2


def range_switch(history: History, rng: np.random.Generator) -> Floats:
    """The amplifier changes its range by itself, and the ranges do not agree."""
    largest = np.max(np.abs(history.force))
    up = rng.uniform(0.4, 0.7) * largest
    down = up - rng.uniform(0.05, 0.2) * largest
    upper = latched(np.abs(history.force), up, down, history.run_starts)
    return upper * (1 + rng.uniform(-0.5, 0.5) * history.force / largest)


def slew_limit(history: History, rng: np.random.Generator) -> Floats:
    """The amplifier's output cannot change faster than at a certain rate."""
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
    """The sampled force is held on a capacitor that droops until it is read."""
    longest = float(np.max(history.steps)) or 1.0
    lost = -np.expm1(-history.steps / (longest * rng.uniform(0.3, 1.5)))
    return -history.relative_force * lost


def dying_battery(history: History, rng: np.random.Generator) -> Floats:
    """The battery that feeds the bridge runs flat, and is then replaced."""
    share = history.order / len(history.order)
    replaced = rng.uniform(0.5, 0.85)
    begin = replaced - rng.uniform(0.25, 0.45)
    spent = np.maximum(share - begin, 0.0) / (replaced - begin)
    return np.where(share < replaced, -history.relative_force * spent**2, 0.0)


def inrush_crosstalk(history: History, rng: np.random.Generator) -> Floats:
    """The inrush current of the motor couples into the bridge at each start."""
    speed = _speed(history)
    turned = np.diff(history.sense, prepend=history.sense[0]) != 0
    starts = (speed > 0) & ((np.diff(speed > 0, prepend=False) != 0) | turned)
    since = history.order - last_true(starts | history.run_starts)
    side = np.where(history.sense > 0, 1.0, rng.uniform(-0.4, 0.5))
    fading = np.exp(-since / rng.uniform(1.0, 4.0))
    return to_one(np.sqrt(speed)) * side * fading


def ground_loop(history: History, rng: np.random.Generator) -> Floats:
    """Current of the running motor returns through the shield of the bridge."""
    lies = rng.standard_normal(int(history.half_cycle[-1]) + 1)
    lies *= rng.uniform(0.7, 1.3) / np.max(np.abs(lies))
    return np.where(history.direction != 0, lies[history.half_cycle], 0.0)


def worn_track(history: History, rng: np.random.Generator) -> Floats:
    """The track of the position sensor is scored where it is used most."""
    begin = rng.uniform(0.1, 0.5)
    pattern = np.zeros(len(history.order))
    for _ in range(rng.integers(5, 9)):
        place = (begin + rng.uniform(0, 0.4)) * float(np.max(history.deformation))
        score = bell(history, place, rng.uniform(0.02, 0.04))
        pattern += rng.standard_normal() * score
    return to_one(pattern)


def lost_steps(history: History, rng: np.random.Generator) -> Floats:
    """The stepper motor is too weak and skips steps near the peak of a load."""
    curve = np.zeros(len(history.order))
    cycles = np.unique(history.cycle)
    skips = rng.random(len(cycles)) < 0.6
    skips[rng.integers(len(cycles))] = True
    for cycle in cycles[skips]:
        rows = np.flatnonzero(history.cycle == cycle)
        pressed = history.deformation[rows]
        first = rows[np.argmax(pressed >= rng.uniform(0.6, 0.95) * np.max(pressed))]
        after = (history.order >= first) & (history.run == history.run[first])
        curve -= after * rng.uniform(0.4, 1.0)
    return curve


def parallax(history: History, rng: np.random.Generator) -> Floats:
    """The dial is read from one side, and from the other after a change of operator."""
    needle = 2 * np.pi * history.force / rng.uniform(40.0, 100.0)
    handover = history.order >= rng.uniform(0.35, 0.65) * len(history.order)
    side = np.where(handover, rng.uniform(-1.0, 0.0), 1.0)
    return side * np.sin(needle - rng.uniform(0, 2 * np.pi))
