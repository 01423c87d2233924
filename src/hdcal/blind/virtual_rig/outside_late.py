"""Mechanisms outside the library for the second round: material, mechanics, heat.

Each gives an additive force error of the order of 1 N, with its place, moment or rate
drawn at random. Places are drawn as shares of the stroke and times as shares of a run,
so that a mechanism falls inside the record whatever its size.
"""

import numpy as np

from hdcal.blind.virtual_rig.curves import to_one
from hdcal.blind.virtual_rig.history import Floats, History, last_true


def _way_since_turn(history: History) -> Floats:
    """Way since the last turn of the drive, in strokes."""
    turns = np.diff(history.half_cycle, prepend=-1) != 0
    before = np.maximum(last_true(turns) - 1, 0)
    return (history.travel - history.travel[before]) / np.max(history.deformation)


def _followed(target: Floats, constant: float, history: History) -> Floats:
    """Follow a target exponentially in time; nothing moves between mountings."""
    kept, state = np.exp(-history.steps / constant), target.copy()
    for row in range(1, len(state)):
        state[row] = target[row] + (state[row - 1] - target[row]) * kept[row]
    return state


def _swing(turns: Floats, rising: float | Floats) -> Floats:
    """Rise from -1 to 1 during a share of each turn, and fall in the rest."""
    part = turns % 1.0
    return np.where(
        part < rising, 2 * part / rising - 1, 1 - 2 * (part - rising) / (1 - rising)
    )


def healing_pad(history: History, rng: np.random.Generator) -> Floats:
    """The filled rubber pad is softened by each peak, and heals while it waits.

    Below the largest load that it remembers it gives way, most at half of it; the
    memory fades with time, so that the next load finds it half healed.
    """
    share = history.relative_deformation
    kept = np.exp(-history.steps / (history.run_length * rng.uniform(0.15, 0.6)))
    remembered = share.copy()
    for row in range(1, len(share)):
        remembered[row] = max(remembered[row - 1] * kept[row], share[row])
    bent = np.clip(share, 0.0, None) ** rng.uniform(0.7, 1.5)
    return -4 * bent * (remembered - share)


def transforming_clip(history: History, rng: np.random.Generator) -> Floats:
    """A clip of shape memory alloy changes its phase under load, and changes back.

    While it transforms it yields; it comes back at a lower load than it went, and both
    loads rise with the temperature.
    """
    share, span = history.relative_deformation, rng.uniform(0.15, 0.3)
    there = rng.uniform(0.4, 0.6) + rng.uniform(0.002, 0.007) * history.warmer
    least = np.clip((share - there) / span, 0.0, 1.0)
    most = np.clip((share - there + rng.uniform(0.15, 0.3)) / span, 0.0, 1.0)
    transformed = least.copy()
    for row in range(1, len(share)):
        transformed[row] = np.clip(transformed[row - 1], least[row], most[row])
    return -transformed


def growing_delamination(history: History, rng: np.random.Generator) -> Floats:
    """A glued layer peels off farther with every load, and gapes when pressed.

    Below some load the faces still touch and nothing is missing; beyond it the layer
    no longer helps, by more and more as the peeling speeds up.
    """
    opens = rng.uniform(0.3, 0.6)
    gaping = np.maximum(history.relative_deformation - opens, 0.0) / (1 - opens)
    speeding = rng.uniform(2.0, 4.0)
    peeled = np.expm1(speeding * to_one(np.cumsum(gaping))) / np.expm1(speeding)
    return -gaping * peeled


def bunched_strip(history: History, rng: np.random.Generator) -> Floats:
    """A glued strip under the punch ratchets along, and bunches into a fold.

    Each load drags it on by some more and never back; the fold is met at first touch
    and is pressed flat by the load.
    """
    cycles, which = np.unique(history.cycle, return_inverse=True)
    fold = to_one(np.cumsum(rng.uniform(0.2, 1.0, len(cycles))))
    reach = rng.uniform(0.1, 0.25)
    return fold[which] * np.exp(-history.relative_deformation / reach)


def set_grease(history: History, rng: np.random.Generator) -> Floats:
    """Grease sets while the rig rests, and has to be broken loose.

    The first movement after a rest is dragged, by the logarithm of the rest; the drag
    is kneaded away on a part of the stroke. A new mounting has rested for long.
    """
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
    """A worn pin moves freely in its slot at first, and then pinches.

    After each turn of the drive there is play, far more in one direction than in the
    other; what follows is a drag that grows until the next turn.
    """
    up, down = rng.permutation([rng.uniform(0.15, 0.4), rng.uniform(0.5, 0.75)])
    play = np.where(history.sense > 0, up, down)
    return history.sense * np.maximum(_way_since_turn(history) - play, 0.0) / 0.5


def creeping_roller(history: History, rng: np.random.Generator) -> Floats:
    """The friction roller of the drive is out of round, and creeps on its rod.

    Its run-out returns with every turn of the roller, but as it slips a little on all
    ways, each pass meets it at another place.
    """
    strokes = history.travel / np.max(history.deformation)
    turned = history.relative_deformation / rng.uniform(0.3, 0.8)
    slipped = rng.choice([-1, 1]) * rng.uniform(0.06, 0.2) * strokes
    phase = 2 * np.pi * (turned + slipped + rng.random())
    second = rng.uniform(0.0, 0.5) * np.sin(2 * phase + rng.uniform(0, 2 * np.pi))
    return np.sin(phase) + second


def tilting_table(history: History, rng: np.random.Generator) -> Floats:
    """The table tips on its bearing once the load is far enough off its middle.

    The preload holds it until the moment is too large; where the load bears depends on
    the mounting angle, and on the other side the table tips the other way.
    """
    towards = rng.choice(np.unique(history.angle)) + rng.normal(0.0, 0.3)
    moment = history.relative_deformation * np.cos(history.angle - towards)
    preload = rng.uniform(0.3, 0.6)
    return np.sign(moment) * np.maximum(np.abs(moment) - preload, 0.0) / (1 - preload)


def two_lips(history: History, rng: np.random.Generator) -> Floats:
    """The punch has two lips, and for a part of the stroke both of them bear.

    The second touches as the ring flattens, and some way farther the first lifts off.
    On the way back the ring clings to the second one for longer.
    """
    touches = rng.uniform(0.2, 0.4)
    fullest = touches + rng.uniform(0.15, 0.3)
    lifts = fullest + rng.uniform(0.08, 0.25)
    clings = np.where(history.sense < 0, rng.uniform(0.05, 0.15), 0.0)
    place = history.relative_deformation + clings
    return np.interp(place, [touches, fullest, lifts], [0.0, 1.0, 0.0])


def starved_bearing(history: History, rng: np.random.Generator) -> Floats:
    """The air bearing touches down whenever the pressure of its tank is low.

    The compressor fills the tank fast and at a fixed beat; as the tank empties, the
    carriage drags, more and more until it floats again.
    """
    beat = history.run_length * rng.uniform(0.12, 0.4)
    filling = rng.uniform(0.1, 0.3)
    pressure = _swing(history.time / beat + rng.random(), filling)
    touching = np.maximum(rng.uniform(-0.4, 0.2) - pressure, 0.0)
    return history.sense * touching


def frame_gradient(history: History, rng: np.random.Generator) -> Floats:
    """The frame warms from outside, and bows until its core has followed.

    After each change of temperature the skin runs ahead of the core; the bow comes
    and goes, and nothing is left of it in the end.
    """
    skin = history.run_length * rng.uniform(0.04, 0.12)
    core = history.run_length * rng.uniform(0.25, 0.6)
    outside = _followed(history.temperature, skin, history)
    return (outside - _followed(history.temperature, core, history)) / 10.0


def swinging_thermostat(history: History, rng: np.random.Generator) -> Floats:
    """The chamber's thermostat knows on and off only, so the heat swings.

    The thermometer is too slow to show it. The swing is wider in a hot chamber, where
    it also takes longer to rise than to fall.
    """
    beat = history.run_length * rng.uniform(0.1, 0.3)
    rising = np.clip(0.15 + history.rise / rng.uniform(45.0, 75.0), 0.1, 0.9)
    width = np.maximum(history.rise, 3.0) / 30.0
    return width * _swing(history.time / beat + rng.random(), rising)


def conducted_heat(history: History, rng: np.random.Generator) -> Floats:
    """The harder the hot ring is pressed, the more heat it gives to the load cell.

    The cell's zero follows the heat through the contact, late: it is highest after the
    peak of a load.
    """
    constant = history.run_length * rng.uniform(0.05, 0.2)
    flow = history.relative_deformation ** rng.uniform(0.5, 1.5) * history.rise / 15.0
    return _followed(flow, constant, history)
