"""Mechanisms outside the library: friction and drives.

Every public function is one of them, see `outside`.
"""

import numpy as np
import scipy

from benchmarks.blind.rig.history import (
    Floats,
    History,
    bell,
    drawn_place,
    last_true,
    swing,
    to_one,
)


def _way_since_turn(history: History) -> Floats:
    """Distance since the last turn of the drive, in strokes."""
    before = np.maximum(last_true(history.turns) - 1, 0)
    return (history.travel - history.travel[before]) / np.max(history.deformation)


def tooth_catch(history: History, rng: np.random.Generator) -> Floats:
    """A tooth of the ring catches on the punch's edge, bends, and snaps free."""
    begin = drawn_place(history, rng, 0.15, 0.6)
    ramp = (history.deformation - begin) / rng.uniform(0.09, 0.2)
    return np.where((ramp > 0) & (ramp < 1) & (history.sense > 0), ramp, 0.0)


def stick_slip(history: History, rng: np.random.Generator) -> Floats:
    """A dry guide sticks, winds up and lets go, again and again."""
    period = rng.uniform(0.07, 0.2)
    phase = 2 * np.pi * (history.travel / period + rng.random())
    return history.sense * scipy.signal.sawtooth(phase)


def side_drag(history: History, rng: np.random.Generator) -> Floats:
    """The ring pushes the carriage sideways onto its guide, by the mounting angle."""
    around = np.cos(history.angle - rng.uniform(0, 2 * np.pi))
    load = history.relative_deformation ** rng.uniform(0.5, 1.5)
    return history.sense * load * around


def running_in(history: History, rng: np.random.Generator) -> Floats:
    """A freshly mounted seat rubs, and polishes itself within a few cycles."""
    first = np.maximum.accumulate(np.where(history.run_starts, history.cycle, 0))
    return history.sense * np.exp(-(history.cycle - first) / rng.uniform(0.6, 2.0))


def binding_guide(history: History, rng: np.random.Generator) -> Floats:
    """The rail is bent, and the carriage binds where the rail is thickest."""
    there = bell(history, drawn_place(history, rng, 0.3, 0.7), rng.uniform(0.04, 0.09))
    scale = rng.choice([-1, 1]) * rng.uniform(12.0, 25.0)
    return history.sense * there * 2 ** (history.warmer / scale)


def direction_by_temperature(history: History, rng: np.random.Generator) -> Floats:
    """Grease thins as it warms, so the loop between loading and unloading narrows."""
    scale = rng.uniform(10.0, 40.0)
    width = history.relative_deformation ** rng.uniform(0.0, 1.0)
    return history.sense * width * np.expm1(-history.warmer / scale)


def oil_suction(history: History, rng: np.random.Generator) -> Floats:
    """Oil between punch and ring holds the punch back as it lifts off."""
    reach = rng.uniform(0.04, 0.1)
    thickness = 2 ** (-history.warmer / rng.uniform(20.0, 40.0))
    pull = thickness * np.exp(-history.deformation / reach)
    return np.where(history.sense < 0, -pull, 0.0)


def set_grease(history: History, rng: np.random.Generator) -> Floats:
    """Grease sets while the rig rests, and has to be broken loose."""
    setting = history.run_length * rng.uniform(0.01, 0.05)
    reach = float(np.max(history.deformation)) * rng.uniform(0.1, 0.3)
    moved = np.abs(np.diff(history.deformation, prepend=history.deformation[0]))
    drag, rest, way = np.zeros(len(moved)), 0.0, 0.0
    for row, starts in enumerate(history.run_starts):
        if starts:
            rest, way = history.run_length, 0.0
        elif moved[row] == 0.0:
            rest, way = history.steps[row] + rest * (way == 0.0), 0.0
        else:
            way += moved[row]
            drag[row] = np.log1p(rest / setting) * np.exp(-way / reach)
    return history.sense * to_one(drag)


def pinched_pin(history: History, rng: np.random.Generator) -> Floats:
    """A worn pin moves freely in its slot at first, and then pinches."""
    up, down = rng.permutation([rng.uniform(0.15, 0.4), rng.uniform(0.5, 0.75)])
    play = np.where(history.sense > 0, up, down)
    return history.sense * np.maximum(_way_since_turn(history) - play, 0.0) / 0.5


def creeping_roller(history: History, rng: np.random.Generator) -> Floats:
    """The friction roller of the drive is out of round, and creeps on its rod."""
    strokes = history.travel / np.max(history.deformation)
    turned = history.relative_deformation / rng.uniform(0.3, 0.8)
    slipped = rng.choice([-1, 1]) * rng.uniform(0.06, 0.2) * strokes
    phase = 2 * np.pi * (turned + slipped + rng.random())
    second = rng.uniform(0.0, 0.5) * np.sin(2 * phase + rng.uniform(0, 2 * np.pi))
    return np.sin(phase) + second


def starved_bearing(history: History, rng: np.random.Generator) -> Floats:
    """The air bearing touches down whenever the pressure of its tank is low."""
    beat = history.run_length * rng.uniform(0.12, 0.4)
    filling = rng.uniform(0.1, 0.3)
    pressure = swing(history.time / beat + rng.random(), filling)
    touching = np.maximum(rng.uniform(-0.4, 0.2) - pressure, 0.0)
    return history.sense * touching


def hunting_drive(history: History, rng: np.random.Generator) -> Floats:
    """The drive's controller overshoots at each turn and hunts for its position."""
    rows = history.order - last_true(history.turns)
    phase = 2 * np.pi * (rows / rng.uniform(3.0, 6.0) + rng.uniform(-0.15, 0.15))
    return history.sense * np.cos(phase) * np.exp(-rows / rng.uniform(3.0, 6.0))


def hasty_reader(history: History, rng: np.random.Generator) -> Floats:
    """The operator waits less and less for the reading to settle, until a break."""
    share = history.order / len(history.order)
    breaks = np.concatenate([[0.0], np.sort(rng.uniform(0.2, 0.8, rng.integers(1, 3)))])
    since = share - breaks[np.searchsorted(breaks, share, side="right") - 1]
    load = history.relative_deformation ** rng.uniform(0.5, 1.5)
    return history.sense * load * to_one(since)
