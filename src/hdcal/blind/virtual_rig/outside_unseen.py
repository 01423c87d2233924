"""Mechanisms outside the library, kept back until the method was settled.

Each gives an additive force error of the order of 1 N, with its place, moment or rate
drawn at random. Places are drawn as shares of the stroke and times as shares of a run,
so that a mechanism falls inside the record whatever its size.
"""

import numpy as np

from hdcal.blind.virtual_rig.curves import bell, drawn_place, to_one
from hdcal.blind.virtual_rig.history import Floats, History, last_true


def _load(history: History) -> Floats:
    """Force of the gear as a share of the record's largest."""
    return to_one(history.force)


def binding_guide(history: History, rng: np.random.Generator) -> Floats:
    """The rail is bent, and the carriage binds where the rail is thickest.

    The drag opposes the movement there and nowhere else; the carriage shrinks onto the
    rail or clears it as the rig warms.
    """
    there = bell(history, drawn_place(history, rng, 0.3, 0.7), rng.uniform(0.04, 0.09))
    scale = rng.choice([-1, 1]) * rng.uniform(12.0, 25.0)
    return history.sense * there * 2 ** (history.warmer / scale)


def oil_suction(history: History, rng: np.random.Generator) -> Floats:
    """Oil between punch and ring holds the punch back as it lifts off.

    The pull is felt at the end of unloading only, and more when the oil is cold.
    """
    reach = rng.uniform(0.04, 0.1)
    thickness = 2 ** (-history.warmer / rng.uniform(20.0, 40.0))
    pull = thickness * np.exp(-history.deformation / reach)
    return np.where(history.sense < 0, -pull, 0.0)


def wrinkling(history: History, rng: np.random.Generator) -> Floats:
    """The thin wall wrinkles beyond a critical load, wave upon wave.

    Each wave gives way and is then backed up by the next; the waves grow and crowd
    together with the deformation, the same on the way up and down.
    """
    onset = drawn_place(history, rng, 0.25, 0.45)
    past = np.maximum(history.deformation - onset, 0.0)
    waves = (past / rng.uniform(0.18, 0.28)) ** rng.uniform(1.2, 1.5)
    return -np.minimum(past / 0.15, 1.0) * np.sin(2 * np.pi * waves)


def worn_track(history: History, rng: np.random.Generator) -> Floats:
    """The track of the position sensor is scored where it is used most.

    Over a part of the stroke the position is wrong by a jagged pattern without period,
    and each pass meets the same pattern again.
    """
    begin = rng.uniform(0.1, 0.5)
    pattern = np.zeros(len(history.order))
    for _ in range(rng.integers(5, 9)):
        place = (begin + rng.uniform(0, 0.4)) * float(np.max(history.deformation))
        score = bell(history, place, rng.uniform(0.02, 0.04))
        pattern += rng.standard_normal() * score
    return to_one(pattern)


def virgin_pad(history: History, rng: np.random.Generator) -> Floats:
    """The rubber pad below the seat is stiff until it has been pressed once.

    Wherever the deformation goes farther than ever since the mounting the force is too
    high; where it has been before the pad is soft. Each mounting has a new pad.
    """
    farthest, starts = np.zeros(len(history.order)), history.run_starts
    for row in range(1, len(farthest)):
        if not starts[row]:
            farthest[row] = max(farthest[row - 1], history.deformation[row - 1])
    share = history.relative_deformation
    bulge = share ** rng.uniform(0.7, 1.5) * (1 - share) ** rng.uniform(0.5, 1.5)
    return np.where(history.deformation > farthest, to_one(bulge), 0.0)


def lost_steps(history: History, rng: np.random.Generator) -> Floats:
    """The stepper motor is too weak and skips steps near the peak of a load.

    The drive is then short of where it believes to be, and shorter with every skip,
    until it is homed at the next mounting. Not every load makes it skip.
    """
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


def two_seats(history: History, rng: np.random.Generator) -> Floats:
    """The ring rocks between two seats whenever it is free of load.

    For each load it rests on one or the other, to and fro; one of the two is chamfered,
    and from some load on the ring slides down it.
    """
    cycles, which = np.unique(history.cycle, return_inverse=True)
    rocks = rng.random(len(cycles)) < rng.uniform(0.6, 0.9)
    chamfered = (np.cumsum(rocks) + rng.integers(2)) % 2
    slides = rng.uniform(0.3, 0.6)
    past = np.maximum(history.relative_deformation - slides, 0.0) / (1 - slides)
    return -past * chamfered[which]


def walking_ring(history: History, rng: np.random.Generator) -> Floats:
    """The ring turns in its seat a little with every movement of the punch.

    It stands no more at the angle that was set; what differs around the ring is met at
    the wrong angle, by more and more until the next mounting.
    """
    base = np.where(history.run_starts, history.travel, 0.0)
    walked = history.travel - np.maximum.accumulate(base)
    lobes = rng.integers(2, 4)
    stands = history.angle + rng.uniform(0.2, 0.5) * walked
    origin = rng.uniform(0, 2 * np.pi)
    met = np.cos(lobes * stands - origin) - np.cos(lobes * history.angle - origin)
    return history.relative_deformation * met


def skidding_punch(history: History, rng: np.random.Generator) -> Floats:
    """The punch skids off the crown of the ring, each time somewhere else.

    Force is lost at once and stays lost until the punch is lifted; the place and the
    loss are new in every cycle, and some cycles go without.
    """
    curve = np.zeros(len(history.order))
    lifted = rng.uniform(0.05, 0.15)
    for cycle in np.unique(history.cycle):
        rows = np.flatnonzero(history.cycle == cycle)
        share = history.relative_deformation[rows]
        reached = np.maximum.accumulate(share) >= rng.uniform(0.3, 1.1)
        curve[rows] = -rng.uniform(0.4, 1.0) * (reached & (share > lifted))
    return curve


def hot_creep(history: History, rng: np.random.Generator) -> Floats:
    """The glue under the strain gauges gives way under load, the faster the hotter.

    The zero creeps by load and time together, several times as fast at the highest
    temperature as at the lowest, and never comes back.
    """
    doubling = rng.uniform(5.0, 12.0)
    speed = history.relative_deformation * 2 ** (history.warmer / doubling)
    return to_one(np.cumsum(speed * history.steps))


def dew(history: History, rng: np.random.Generator) -> Floats:
    """Dew settles on the bare bridge while it is cold, and dries off when warm.

    Below the dew point a film grows slowly and shunts the bridge; above it the film is
    gone much faster.
    """
    cold = history.temperature < rng.uniform(24.0, 33.0)
    growth = history.run_length * rng.uniform(0.3, 1.0)
    drying = history.run_length * rng.uniform(0.05, 0.2)
    kept = np.exp(-history.steps / np.where(cold, growth, drying))
    film = np.zeros(len(history.order))
    for row in range(1, len(film)):
        film[row] = cold[row] + (film[row - 1] - cold[row]) * kept[row]
    return film


def heater_pickup(history: History, rng: np.random.Generator) -> Floats:
    """The heater's current shifts the zero as long as its relay is closed.

    The relay closes at a fixed beat, and for longer in each beat the hotter the chamber
    has to be.
    """
    beat = history.run_length * rng.uniform(0.08, 0.25)
    duty = np.clip(0.1 + history.rise / rng.uniform(45.0, 75.0), 0.05, 0.9)
    return ((history.time / beat + rng.random()) % 1 < duty).astype(float)


def hasty_reader(history: History, rng: np.random.Generator) -> Floats:
    """The operator waits less and less for the reading to settle, until a break.

    What has not settled lags the movement and grows with the load; after each break
    the operator is patient again.
    """
    share = history.order / len(history.order)
    breaks = np.concatenate([[0.0], np.sort(rng.uniform(0.2, 0.8, rng.integers(1, 3)))])
    since = share - breaks[np.searchsorted(breaks, share, side="right") - 1]
    load = history.relative_deformation ** rng.uniform(0.5, 1.5)
    return history.sense * load * to_one(since)


def peak_hold(history: History, rng: np.random.Generator) -> Floats:
    """The display's peak hold is left on for a cycle or two.

    It follows the force upwards, but on the way down it clings to the peak and lets go
    only slowly.
    """
    cycles = np.unique(history.cycle)
    first = cycles[rng.integers(len(cycles))]
    left_on = (history.cycle >= first) & (history.cycle < first + rng.integers(1, 3))
    leak = rng.uniform(0.94, 0.99)
    held, starts = history.force.copy(), history.run_starts
    for row in range(1, len(held)):
        if left_on[row] and left_on[row - 1] and not starts[row]:
            held[row] = max(held[row], leak * held[row - 1])
    return to_one(held - history.force)


def uneven_bits(history: History, rng: np.random.Generator) -> Floats:
    """The converter's resistors are off, so each upper bit weighs a little wrong.

    The error jumps wherever one of the three highest bits of the force turns over, at
    eighths of the converter's range.
    """
    code = np.floor(8 * np.abs(_load(history)) / rng.uniform(1.02, 1.5)).astype(int)
    bits = (code[:, None] >> np.array([2, 1, 0])) & 1
    # Neighbours of one sign would be little but a wrong gain.
    wrong = rng.uniform(0.4, 1.0, 3) * np.array([1, -1, rng.choice([-1, 1])])
    return bits @ wrong


def dying_battery(history: History, rng: np.random.Generator) -> Floats:
    """The battery that feeds the bridge runs flat, and is then replaced.

    The gain holds for long, sags faster and faster, and is as before with the new
    battery.
    """
    share = history.order / len(history.order)
    replaced = rng.uniform(0.5, 0.85)
    begin = replaced - rng.uniform(0.25, 0.45)
    spent = np.maximum(share - begin, 0.0) / (replaced - begin)
    return np.where(share < replaced, -_load(history) * spent**2, 0.0)


def hunting_drive(history: History, rng: np.random.Generator) -> Floats:
    """The drive's controller overshoots at each turn and hunts for its position.

    The swing starts afresh in the new direction and dies out within some rows.
    """
    turns = np.diff(history.half_cycle, prepend=-1) != 0
    rows = history.order - last_true(turns)
    swing = 2 * np.pi * (rows / rng.uniform(3.0, 6.0) + rng.uniform(-0.15, 0.15))
    return history.sense * np.cos(swing) * np.exp(-rows / rng.uniform(3.0, 6.0))
