"""Mechanisms of table and gear, in another form than a textbook's.

Every size is in the unit that its function names; shapes are drawn over what real
rigs show. Sources are named where a form is somebody's.
"""

from functools import cache
from importlib.resources import files

import numpy as np
import scipy

from hdcal.blind.virtual_rig.history import FULL
from hdcal.blind.virtual_rig.mechanism import (
    Mechanism,
    RigState,
    Shape,
    bent_line,
    draw_bend,
    draw_members,
)


def clearance(x, state: RigState, size: float, shape: Shape):
    """Three seats of a mounting close one after the other; size: mean clearance [mm].

    Each carries a third of the load and yields smoothly over its own roughness.
    """
    closed = 0.0
    for place, rough in zip(shape["places"], shape["rough"], strict=True):
        width = rough * size
        closed += width * np.logaddexp(0.0, (x - place * size) / width) / 3.0
    return closed - x


def _seats(rng) -> Shape:
    places = 1.0 + rng.uniform(0.0, 0.4) * np.array([-1.0, 0.0, 1.0])
    return {"places": places, "rough": rng.uniform(0.04, 0.25, 3)}


def asperities(force, state: RigState, size: float, shape: Shape):
    """Rough pads in series with the gear close by h ln(1 + F/P); size: h [mm].

    Exponential heights of the asperities: Greenwood and Williamson (1966).
    """
    stiffness = float(np.mean(state.stiffness))
    grid = np.linspace(0.0, 1.5 * np.max(np.abs(force)) + 1.0, 2000)
    closing = size * np.log1p(grid / (shape["load"] * stiffness * FULL))
    whole = grid / stiffness + closing
    at = np.abs(force) / stiffness
    carried = np.interp(at, whole, grid)
    return np.sign(force) * (carried - np.abs(force))


def transducer(x, state: RigState, size: float, shape: Shape):
    """A transformer gauge off its middle: quadratic and some cubic error; size [mm]."""
    place = x / FULL
    return size * (place**2 + shape["cubic"] * place**3)


def lead_screw(x, state: RigState, size: float, shape: Shape):
    """Once-per-turn error with a second harmonic, growing with wear; size [mm]."""
    turn = 2.0 * np.pi * x / shape["pitch"] + shape["phase"]
    wear = 1.0 + shape["wear"] * x / FULL
    second = shape["second"] * np.sin(2.0 * turn + shape["other"])
    return size * wear * (np.sin(turn) + second)


def _screw(rng) -> Shape:
    phase, other = rng.uniform(0.0, 2.0 * np.pi, 2)
    pitch, second = np.exp(rng.uniform(np.log(0.25), np.log(0.6))), rng.uniform(0, 0.3)
    wear = rng.uniform(-0.3, 0.3)
    return {
        "pitch": pitch,
        "phase": phase,
        "other": other,
        "second": second,
        "wear": wear,
    }


@cache
def _curve(table: str) -> "scipy.interpolate.PchipInterpolator":
    """Return the curve through a table of finite-element results.

    The first lines of a table say what it holds. `python -m
    benchmarks.virtual_rig_elements` in a checkout makes it.
    """
    text = (files("hdcal.blind.virtual_rig") / table).read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return scipy.interpolate.PchipInterpolator(*np.loadtxt(lines[1:], delimiter=",").T)


def contact_line(force, state: RigState, size: float, shape: Shape):
    """The line of contact moves down the cup, which is stiffer there; size [mm].

    Size is how far it has moved at full deformation; the stiffness is that of the
    finite-element cup.
    """
    moved = size * (np.maximum(state.deformation, 0.0) / FULL) ** shape["power"]
    return force * (_curve("cup.csv")(62.0 - moved) - 1.0)


def large_displacement(force, state: RigState, size: float, shape: Shape):
    """The ring leaves its small-displacement shape; size: 1/R [1/mm]."""
    return force * (_curve("ring.csv")(state.deformation * size) - 1.0)


def yielding(force, state: RigState, size: float, shape: Shape):
    """The wall yields and hardens for good; size: permanent set at full load [mm].

    What has flowed once never flows back: the set is the largest so far, by specimen.
    """
    over = np.maximum(state.deformation / FULL - shape["begin"], 0.0)
    flow = (over / (1.0 - shape["begin"])) ** shape["power"]
    for gear in np.unique(state.history.specimen):
        own = state.history.specimen == gear
        flow[own] = np.maximum.accumulate(flow[own])
    return -size * state.stiffness * flow


def fatigue(force, state: RigState, size: float, shape: Shape):
    """Stiffness falls with the cycles, fast at first; size: loss over ten cycles."""
    cycle, gear = state.history.cycle, state.history.specimen
    first = [cycle[gear == each][0] for each in np.unique(gear)]
    count = (cycle - np.asarray(first)[gear]) / 9.0
    return -size * state.stiffness * state.deformation * count ** shape["power"]


def wall(force, state: RigState, size: float, shape: Shape):
    """The wall is thicker on one side and oval; size: relative thickness."""
    angle = state.history.angle
    once = shape["once"] * np.cos(angle - shape["first"])
    twice = shape["twice"] * np.cos(2.0 * (angle - shape["second"]))
    thrice = 0.15 * np.cos(3.0 * (angle - shape["third"]))
    return force * ((1.0 + size * (once + twice + thrice)) ** 3 - 1.0)


def _oval(rng) -> Shape:
    first, second, third = rng.uniform(0.0, 2.0 * np.pi, 3)
    once = rng.uniform(0.3, 1.0)
    return {
        "once": once,
        "twice": rng.uniform(0.3, 1.0),
        "first": first,
        "second": second,
        "third": third,
    }


def softening(force, state: RigState, size: float, shape: Shape):
    """Seat and pads lose stiffness with temperature beside the steel; size [1/K]."""
    rise = state.history.rise
    return force * size * rise * (1.0 + shape["bend"] * rise)


def gears_differ(force, state: RigState, size: float, shape: Shape):
    """Walls of the gears scatter in thickness, δ³ in stiffness; size: relative sd."""
    thickness = 1.0 + size * shape["members"][state.history.specimen]
    return force * (thickness**3 - 1.0)


def _flow(rng) -> Shape:
    return {"begin": rng.uniform(0.5, 0.85), "power": rng.uniform(1.0, 1.8)}


MECHANICS: dict[str, Mechanism] = {
    "seating_slack": Mechanism(
        "table", clearance, 0.12, draw=_seats, amplitude="seating_slack.clearance"
    ),
    # The frame grows [mm/K].
    "thermal_expansion": Mechanism(
        "table",
        bent_line,
        0.004,
        frozenset({"temperature"}),
        draw=draw_bend,
        signed=True,
        amplitude="thermal_expansion.slope",
    ),
    "displacement_nonlinearity": Mechanism(
        "table",
        transducer,
        0.03,
        draw=lambda rng: {"cubic": rng.uniform(-0.3, 0.3)},
        signed=True,
    ),
    "screw_error": Mechanism("table", lead_screw, 0.015, draw=_screw),
    "contact_bedding": Mechanism(
        "gear", asperities, 0.06, draw=lambda rng: {"load": rng.uniform(0.02, 0.3)}
    ),
    "progressive_stiffening": Mechanism(
        "gear", contact_line, 15.0, draw=lambda rng: {"power": rng.uniform(0.8, 1.3)}
    ),
    "large_deflection": Mechanism("gear", large_displacement, 0.045),
    "plastic_yield": Mechanism(
        "gear", yielding, 0.08, frozenset({"unloading"}), draw=_flow
    ),
    "stiffness_fatigue": Mechanism(
        "gear",
        fatigue,
        0.06,
        frozenset({"cycles"}),
        draw=lambda rng: {"power": rng.uniform(0.2, 0.6)},
    ),
    "ovality": Mechanism("gear", wall, 0.05, frozenset({"angle"}), draw=_oval),
    "thermal_stiffness": Mechanism(
        "gear",
        softening,
        0.0015,
        frozenset({"temperature"}),
        draw=draw_bend,
        signed=True,
    ),
    "specimen_variation": Mechanism(
        "gear", gears_differ, 0.06, frozenset({"specimens"}), draw=draw_members
    ),
}
