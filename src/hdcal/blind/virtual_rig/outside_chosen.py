"""Mechanisms outside the library, chosen as what happens to real rigs.

Each gives an additive force error of the order of 1 N, with its place, moment or rate
drawn at random. Places are drawn as shares of the stroke and times as shares of a run,
so that a mechanism falls inside the record whatever its size.
"""

import numpy as np
import scipy

from hdcal.blind.virtual_rig.curves import bell, beyond, drawn_place, to_one
from hdcal.blind.virtual_rig.history import Flags, Floats, History, last_true


def _stretch(history: History, rng: np.random.Generator) -> Flags:
    """Draw a quarter to a half of the record, whole half-cycles in a row."""
    halves = history.half_cycle
    count = int(halves[-1]) + 1
    length = max(1, round(count * rng.uniform(0.25, 0.5)))
    first = rng.integers(0, count - length + 1)
    return (halves >= first) & (halves < first + length)


def _latched(level: Floats, up: float, down: float, starts: Flags) -> Flags:
    """Switch on above one level and off below a lower one, else stay."""
    return level[last_true((level > up) | (level < down) | starts)] > up


def burr(history: History, rng: np.random.Generator) -> Floats:
    """A burr on the guide rubs at one spot of the stroke.

    The carriage climbs over it at the same deformation in every pass.
    """
    width = rng.uniform(0.02, 0.045)
    return bell(history, drawn_place(history, rng, 0.2, 0.8), width)


def tooth_catch(history: History, rng: np.random.Generator) -> Floats:
    """A tooth of the ring catches on the punch's edge, bends, and snaps free.

    On loading the force ramps up over a range and falls back at once; on unloading the
    tooth slides by without touching.
    """
    begin = drawn_place(history, rng, 0.15, 0.6)
    ramp = (history.deformation - begin) / rng.uniform(0.09, 0.2)
    return np.where((ramp > 0) & (ramp < 1) & (history.sense > 0), ramp, 0.0)


def snap_through(history: History, rng: np.random.Generator) -> Floats:
    """A dent in the thin wall pops through like the lid of a jar.

    Force is lost at once on the way up, won back as the wall around takes over; the
    dent pops back at a lower deformation than it went.
    """
    up = drawn_place(history, rng, 0.35, 0.65)
    down = up - drawn_place(history, rng, 0.1, 0.25)
    popped = _latched(history.deformation, up, down, history.run_starts)
    decay = rng.uniform(0.04, 0.12)
    past = np.maximum(history.deformation - up, 0.0)
    return np.where(popped, -np.exp(-past / decay), 0.0)


def edge_rollover(history: History, rng: np.random.Generator) -> Floats:
    """The tilted punch rolls from its edge onto its face.

    The point of contact, and with it the lever arm, moves from one value to another
    over a small range of deformation.
    """
    width = rng.uniform(0.015, 0.05)
    return np.tanh((history.deformation - drawn_place(history, rng, 0.3, 0.7)) / width)


def stick_slip(history: History, rng: np.random.Generator) -> Floats:
    """A dry guide sticks, winds up and lets go, again and again.

    The sawtooth goes by the way travelled in both directions, so it comes at other
    deformations in every pass.
    """
    period = rng.uniform(0.07, 0.2)
    phase = 2 * np.pi * (history.travel / period + rng.random())
    return history.sense * scipy.signal.sawtooth(phase)


def crushed_chip(history: History, rng: np.random.Generator) -> Floats:
    """A metal chip lies under the punch, is loaded in one pass, and crushes.

    Force rises from first touch to the crush, then the chip is gone for good.
    """
    loading = np.unique(history.half_cycle[history.sense > 0])
    if len(loading) == 0:
        return np.zeros(len(history.order))
    touch = drawn_place(history, rng, 0.0, 0.2)
    ramp = (history.deformation - touch) / (drawn_place(history, rng, 0.5, 0.9) - touch)
    here = history.half_cycle == rng.choice(loading)
    return np.where(here & (ramp > 0) & (ramp < 1), ramp, 0.0)


def foreign_stop(history: History, rng: np.random.Generator) -> Floats:
    """A shim or key is left in the rig's throat for a while, then taken out.

    As long as it lies there the carriage runs onto it and bends it like a spring.
    """
    touch = drawn_place(history, rng, 0.35, 0.7)
    return beyond(history, touch) * _stretch(history, rng)


def closing_gap(history: History, rng: np.random.Generator) -> Floats:
    """A gap between ring and fixture closes by heat, so it is met earlier when warm.

    Past the gap the fixture bears load too; the kink wanders with temperature.
    """
    # An aluminium frame of one to three hundred millimetres, mm per °C.
    rate = rng.uniform(0.0025, 0.006)
    gap = drawn_place(history, rng, 0.5, 0.75) - rate * history.warmer
    return beyond(history, gap)


def hard_spot(history: History, rng: np.random.Generator) -> Floats:
    """A weld bead on the ring meets the fixture at some mounting angles only.

    Within a few degrees of it the ring runs onto the bead past some deformation; at
    all other angles there is nothing, unlike an oval that every angle sees.
    """
    centre = rng.choice(np.unique(history.angle)) + rng.normal(0.0, 0.15)
    near = np.exp(rng.uniform(4.0, 15.0) * (np.cos(history.angle - centre) - 1))
    met = drawn_place(history, rng, 0.35, 0.7)
    return beyond(history, met) * near


def side_drag(history: History, rng: np.random.Generator) -> Floats:
    """The ring pushes the carriage sideways onto its guide, by the mounting angle.

    The guide's drag opposes each movement, grows with the load, and is more at some
    angles and less at others.
    """
    around = np.cos(history.angle - rng.uniform(0, 2 * np.pi))
    load = history.relative_deformation ** rng.uniform(0.5, 1.5)
    return history.sense * load * around


def parallax(history: History, rng: np.random.Generator) -> Floats:
    """The dial is read from one side, and from the other after a change of operator.

    The error follows the needle's angle, a turn per some tens of newtons, and changes
    sign or size when the second operator takes over.
    """
    needle = 2 * np.pi * history.force / rng.uniform(40.0, 100.0)
    handover = history.order >= rng.uniform(0.35, 0.65) * len(history.order)
    seen = np.where(handover, rng.uniform(-1.0, 0.0), 1.0)
    return seen * np.sin(needle - rng.uniform(0, 2 * np.pi))


def range_switch(history: History, rng: np.random.Generator) -> Floats:
    """The amplifier changes its range by itself, and the ranges do not agree.

    It goes up at one force and comes back at a lower one; in the upper range both zero
    and gain are off.
    """
    largest = np.max(np.abs(history.force))
    up = rng.uniform(0.4, 0.7) * largest
    down = up - rng.uniform(0.05, 0.2) * largest
    upper = _latched(np.abs(history.force), up, down, history.run_starts)
    return upper * (1 + rng.uniform(-0.5, 0.5) * history.force / largest)


def running_in(history: History, rng: np.random.Generator) -> Floats:
    """A freshly mounted seat rubs, and polishes itself within a few cycles.

    Friction opposes each movement and dies out with the cycles since the mounting.
    """
    first = np.maximum.accumulate(np.where(history.run_starts, history.cycle, 0))
    return history.sense * np.exp(-(history.cycle - first) / rng.uniform(0.6, 2.0))


def late_channel(history: History, rng: np.random.Generator) -> Floats:
    """For a stretch the logger pairs each position with an earlier force.

    Its buffer slips by one to three rows and catches up again later.
    """
    slip = rng.integers(1, 4)
    earlier = np.maximum(history.order - slip, 0)
    same_run = history.run[earlier] == history.run
    begin = rng.uniform(0.1, 0.6) * len(history.order)
    end = begin + rng.uniform(0.2, 0.35) * len(history.order)
    slipped = (history.order >= begin) & (history.order < end) & same_run
    return to_one(np.where(slipped, history.force[earlier] - history.force, 0.0))


def loose_connector(history: History, rng: np.random.Generator) -> Floats:
    """A plug makes contact in one of two ways and hops between them.

    The zero is at either of two levels, for a random number of rows each.
    """
    hops = rng.random(len(history.order)) < 1 / rng.uniform(4.0, 15.0)
    return (np.cumsum(hops) % 2).astype(float)


def tare_by_cycle(history: History, rng: np.random.Generator) -> Floats:
    """The operator zeroes the display anew before each loading, never quite the same.

    Every cycle has its own offset, unrelated to the one before.
    """
    _, which = np.unique(history.cycle, return_inverse=True)
    return rng.standard_normal(np.max(which) + 1)[which]


def draught(history: History, rng: np.random.Generator) -> Floats:
    """A door opens now and then, and cold air passes over the load cell.

    Each time the zero swings out quickly and comes back more slowly.
    """
    curve = np.zeros(len(history.order))
    for _ in range(rng.integers(2, 5)):
        here = history.run == rng.choice(np.unique(history.run))
        opened = rng.uniform(0.05, 0.8) * np.max(history.time[here])
        swing = rng.uniform(0.03, 0.1) * history.run_length
        since = np.maximum(history.time - opened, 0.0) / swing
        curve += here * rng.uniform(0.5, 1.0) * since * np.exp(1 - since)
    return curve
