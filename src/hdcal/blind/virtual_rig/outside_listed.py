"""Mechanisms outside the library that the specification lists.

Each gives an additive force error of the order of 1 N, with its moment, frequency or
place drawn at random. Times are drawn as shares of the record, because a disturbance
much faster or slower than the record would show as noise or as a constant.
"""

import numpy as np

from hdcal.blind.virtual_rig.history import Floats, History


def step_in_mounting(history: History, rng: np.random.Generator) -> Floats:
    """The specimen shifts in its seat.

    At an unknown moment in the middle of one run the zero jumps, and it stays there
    until the specimen is mounted anew.
    """
    rows = np.flatnonzero(history.run == rng.choice(np.unique(history.run)))
    moment = round(len(rows) * rng.uniform(0.2, 0.8))
    curve = np.zeros(len(history.order))
    curve[rows[moment:]] = 1.0
    return curve


def hum(history: History, rng: np.random.Generator) -> Floats:
    """Mains pick-up, folded down by slow sampling to a period of a few rows.

    The logger samples either by its own clock or whenever a position is reached.
    """
    steps = history.steps[history.steps > 0]
    by_time = rng.random() < 0.5 and len(steps) > 0
    clock = history.time / np.median(steps) if by_time else history.order
    period = np.exp(rng.uniform(np.log(2.3), np.log(15.0)))
    return np.sin(2 * np.pi * (clock / period + rng.random()))


def angle_by_temperature(history: History, rng: np.random.Generator) -> Floats:
    """The fixture grips unevenly around the ring, and heat changes the grip.

    So the stiffness varies with the mounting angle by an amount that depends on the
    temperature.
    """
    lobes = rng.integers(1, 3)
    around = np.cos(lobes * (history.angle - rng.uniform(0, 2 * np.pi)))
    return history.relative_deformation * around * (history.warmer / 10.0)


def direction_by_temperature(history: History, rng: np.random.Generator) -> Floats:
    """Grease thins as it warms, so the loop between loading and unloading narrows.

    Only the departure from the loop at the mean temperature is given.
    """
    scale = rng.uniform(10.0, 40.0)
    width = history.relative_deformation ** rng.uniform(0.0, 1.0)
    return history.sense * width * np.expm1(-history.warmer / scale)


def thermal_lag(history: History, rng: np.random.Generator) -> Floats:
    """The specimen follows the thermometer late, exponentially in time.

    The reading is corrected for a temperature that the specimen has not yet reached;
    zero and stiffness share the error.
    """
    constant = history.run_length * np.exp(rng.uniform(np.log(0.04), np.log(0.3)))
    lag, kept = np.zeros(len(history.order)), np.exp(-history.steps / constant)
    for row in range(1, len(lag)):
        change = history.temperature[row] - history.temperature[row - 1]
        # A change is met in full by the row that first shows it; waiting comes after.
        lag[row] = lag[row - 1] * kept[row] - change
    share = rng.random()
    return lag / 10.0 * (share + (1 - share) * history.relative_deformation)


def crack(history: History, rng: np.random.Generator) -> Floats:
    """A crack opens near the peak of one cycle: the stiffness drops at once.

    It never closes again: every later reading has the lower stiffness.
    """
    cycles = np.unique(history.cycle)
    # Not the first cycle, if there are more: cracked from the start is only softer.
    middle = round((len(cycles) - 1) * rng.uniform(0.25, 0.75))
    chosen = cycles[min(max(middle, 1), len(cycles) - 1)]
    rows = np.flatnonzero(history.cycle == chosen)
    # It opens on the way up, under the upper third of the load.
    high = history.deformation[rows] >= rng.uniform(0.7, 1.0) * np.max(
        history.deformation[rows]
    )
    opened = history.order >= rows[np.argmax(high)]
    return -history.relative_deformation * opened


def random_walk(history: History, rng: np.random.Generator) -> Floats:
    """The zero wanders: each row adds a small independent shift to the last."""
    count = len(history.order)
    return np.cumsum(rng.standard_normal(count)) / np.sqrt(count)
