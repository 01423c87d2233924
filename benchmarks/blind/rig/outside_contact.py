"""Mechanisms outside the library: contacts, seats and walls.

Every public function is one of them, see `outside`.
"""

import numpy as np

from benchmarks.blind.rig.history import (
    Flags,
    Floats,
    History,
    bell,
    beyond,
    drawn_place,
    latched,
    to_one,
)


def _stretch(history: History, rng: np.random.Generator) -> Flags:
    """Draw a quarter to a half of the record, whole half-cycles in a row."""
    halves = history.half_cycle
    count = int(halves[-1]) + 1
    length = max(1, round(count * rng.uniform(0.25, 0.5)))
    first = rng.integers(0, count - length + 1)
    return (halves >= first) & (halves < first + length)


def burr(history: History, rng: np.random.Generator) -> Floats:
    """A burr on the guide rubs at one spot of the stroke."""
    width = rng.uniform(0.02, 0.045)
    return bell(history, drawn_place(history, rng, 0.2, 0.8), width)


def edge_rollover(history: History, rng: np.random.Generator) -> Floats:
    """The tilted punch rolls from its edge onto its face."""
    width = rng.uniform(0.015, 0.05)
    return np.tanh((history.deformation - drawn_place(history, rng, 0.3, 0.7)) / width)


def snap_through(history: History, rng: np.random.Generator) -> Floats:
    """A dent in the thin wall pops through like the lid of a jar."""
    up = drawn_place(history, rng, 0.35, 0.65)
    down = up - drawn_place(history, rng, 0.1, 0.25)
    popped = latched(history.deformation, up, down, history.run_starts)
    decay = rng.uniform(0.04, 0.12)
    past = np.maximum(history.deformation - up, 0.0)
    return np.where(popped, -np.exp(-past / decay), 0.0)


def crushed_chip(history: History, rng: np.random.Generator) -> Floats:
    """A metal chip lies under the punch, is loaded in one pass, and crushes."""
    loading = np.unique(history.half_cycle[history.sense > 0])
    if len(loading) == 0:
        return np.zeros(len(history.order))
    touch = drawn_place(history, rng, 0.0, 0.2)
    ramp = (history.deformation - touch) / (drawn_place(history, rng, 0.5, 0.9) - touch)
    here = history.half_cycle == rng.choice(loading)
    return np.where(here & (ramp > 0) & (ramp < 1), ramp, 0.0)


def foreign_stop(history: History, rng: np.random.Generator) -> Floats:
    """A shim or key is left in the rig's throat for a while, then taken out."""
    touch = drawn_place(history, rng, 0.35, 0.7)
    return beyond(history, touch) * _stretch(history, rng)


def hard_spot(history: History, rng: np.random.Generator) -> Floats:
    """A weld bead on the ring meets the fixture at some mounting angles only."""
    centre = rng.choice(np.unique(history.angle)) + rng.normal(0.0, 0.15)
    near = np.exp(rng.uniform(4.0, 15.0) * (np.cos(history.angle - centre) - 1))
    met = drawn_place(history, rng, 0.35, 0.7)
    return beyond(history, met) * near


def wrinkling(history: History, rng: np.random.Generator) -> Floats:
    """The thin wall wrinkles beyond a critical load, wave upon wave."""
    onset = drawn_place(history, rng, 0.25, 0.45)
    past = np.maximum(history.deformation - onset, 0.0)
    waves = (past / rng.uniform(0.18, 0.28)) ** rng.uniform(1.2, 1.5)
    return -np.minimum(past / 0.15, 1.0) * np.sin(2 * np.pi * waves)


def two_lips(history: History, rng: np.random.Generator) -> Floats:
    """The punch has two lips, and for a part of the stroke both of them bear."""
    touches = rng.uniform(0.2, 0.4)
    fullest = touches + rng.uniform(0.15, 0.3)
    lifts = fullest + rng.uniform(0.08, 0.25)
    clings = np.where(history.sense < 0, rng.uniform(0.05, 0.15), 0.0)
    place = history.relative_deformation + clings
    return np.interp(place, [touches, fullest, lifts], [0.0, 1.0, 0.0])


def two_seats(history: History, rng: np.random.Generator) -> Floats:
    """The ring rocks between two seats whenever it is free of load."""
    cycles, which = np.unique(history.cycle, return_inverse=True)
    rocks = rng.random(len(cycles)) < rng.uniform(0.6, 0.9)
    chamfered = (np.cumsum(rocks) + rng.integers(2)) % 2
    slides = rng.uniform(0.3, 0.6)
    past = np.maximum(history.relative_deformation - slides, 0.0) / (1 - slides)
    return -past * chamfered[which]


def skidding_punch(history: History, rng: np.random.Generator) -> Floats:
    """The punch skids off the crown of the ring, each time somewhere else."""
    curve = np.zeros(len(history.order))
    lifted = rng.uniform(0.05, 0.15)
    for cycle in np.unique(history.cycle):
        rows = np.flatnonzero(history.cycle == cycle)
        share = history.relative_deformation[rows]
        reached = np.maximum.accumulate(share) >= rng.uniform(0.3, 1.1)
        curve[rows] = -rng.uniform(0.4, 1.0) * (reached & (share > lifted))
    return curve


def tilting_table(history: History, rng: np.random.Generator) -> Floats:
    """The table tips on its bearing once the load is far enough off its middle."""
    towards = rng.choice(np.unique(history.angle)) + rng.normal(0.0, 0.3)
    moment = history.relative_deformation * np.cos(history.angle - towards)
    preload = rng.uniform(0.3, 0.6)
    return np.sign(moment) * np.maximum(np.abs(moment) - preload, 0.0) / (1 - preload)


def walking_ring(history: History, rng: np.random.Generator) -> Floats:
    """The ring turns in its seat a little with every movement of the punch."""
    base = np.where(history.run_starts, history.travel, 0.0)
    walked = history.travel - np.maximum.accumulate(base)
    lobes = rng.integers(2, 4)
    stands = history.angle + rng.uniform(0.2, 0.5) * walked
    origin = rng.uniform(0, 2 * np.pi)
    met = np.cos(lobes * stands - origin) - np.cos(lobes * history.angle - origin)
    return history.relative_deformation * met


def step_in_mounting(history: History, rng: np.random.Generator) -> Floats:
    """The specimen shifts in its seat."""
    rows = np.flatnonzero(history.run == rng.choice(np.unique(history.run)))
    moment = round(len(rows) * rng.uniform(0.2, 0.8))
    curve = np.zeros(len(history.order))
    curve[rows[moment:]] = 1.0
    return curve


def bunched_strip(history: History, rng: np.random.Generator) -> Floats:
    """A glued strip under the punch ratchets along, and bunches into a fold."""
    cycles, which = np.unique(history.cycle, return_inverse=True)
    fold = to_one(np.cumsum(rng.uniform(0.2, 1.0, len(cycles))))
    reach = rng.uniform(0.1, 0.25)
    return fold[which] * np.exp(-history.relative_deformation / reach)


def growing_delamination(history: History, rng: np.random.Generator) -> Floats:
    """A glued layer peels off farther with every load, and gapes when pressed."""
    opens = rng.uniform(0.3, 0.6)
    gaping = np.maximum(history.relative_deformation - opens, 0.0) / (1 - opens)
    speeding = rng.uniform(2.0, 4.0)
    peeled = np.expm1(speeding * to_one(np.cumsum(gaping))) / np.expm1(speeding)
    return -gaping * peeled


def crack(history: History, rng: np.random.Generator) -> Floats:
    """A crack opens near the peak of one cycle: the stiffness drops at once."""
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


def virgin_pad(history: History, rng: np.random.Generator) -> Floats:
    """The rubber pad below the seat is stiff until it has been pressed once."""
    farthest, starts = np.zeros(len(history.order)), history.run_starts
    for row in range(1, len(farthest)):
        if not starts[row]:
            farthest[row] = max(farthest[row - 1], history.deformation[row - 1])
    share = history.relative_deformation
    bulge = share ** rng.uniform(0.7, 1.5) * (1 - share) ** rng.uniform(0.5, 1.5)
    return np.where(history.deformation > farthest, to_one(bulge), 0.0)


def healing_pad(history: History, rng: np.random.Generator) -> Floats:
    """The filled rubber pad is softened by each peak, and heals while it waits."""
    share = history.relative_deformation
    kept = np.exp(-history.steps / (history.run_length * rng.uniform(0.15, 0.6)))
    remembered = share.copy()
    for row in range(1, len(share)):
        remembered[row] = max(remembered[row - 1] * kept[row], share[row])
    bent = np.clip(share, 0.0, None) ** rng.uniform(0.7, 1.5)
    return -4 * bent * (remembered - share)
