"""Mechanisms of contact and of the wall, in other forms than the library's.

Each function gives the contribution to the signal of its stage; the unit of its size is
in its first line. Shapes are drawn over what real rigs show.
"""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from benchmarks.blind.rig.history import FULL
from benchmarks.blind.rig.virtual_rig import Mechanism, RigState, Shape, draw_members


def clearance(x, state: RigState, size: float, shape: Shape):
    """Three seats of a mounting close in turn; size: mean clearance [mm].

    Each carries a third of the load and yields smoothly over its roughness.
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
    carried = np.interp(np.abs(force) / stiffness, grid / stiffness + closing, grid)
    return np.sign(force) * (carried - np.abs(force))


def second_stop(force, state: RigState, size: float, shape: Shape):
    """A second stop is touched and stiffens as its spots flatten; size: k₂/k."""
    width = shape["round"]
    depth = width * np.logaddexp(0.0, (state.deformation - shape["onset"]) / width)
    return size * state.stiffness * FULL * (depth / FULL) ** shape["power"]


def _stop(rng) -> Shape:
    onset, power = rng.uniform(0.15, 0.42), rng.uniform(1.0, 1.3)
    return {"onset": onset, "power": power, "round": rng.uniform(0.002, 0.02)}


@cache
def _curve(table: str) -> PchipInterpolator:
    """Return the curve through a table of finite-element results."""
    rows = np.loadtxt(Path(__file__).with_name(table), delimiter=",")
    return PchipInterpolator(*rows.T)


def contact_line(force, state: RigState, size: float, shape: Shape):
    """The line of contact moves down the finite-element cup; size: in all [mm]."""
    moved = size * (np.maximum(state.deformation, 0.0) / FULL) ** shape["power"]
    return force * (_curve("cup.csv")(62.0 - moved) - 1.0)


def large_displacement(force, state: RigState, size: float, shape: Shape):
    """Force of the finite-element ring at large displacement; size: 1/R [1/mm]."""
    return force * (_curve("ring.csv")(state.deformation * size) - 1.0)


def yielding(force, state: RigState, size: float, shape: Shape):
    """The wall yields and hardens; size: permanent set at full load [mm].

    The set never recovers: it is the largest so far, by specimen.
    """
    over = np.maximum(state.deformation / FULL - shape["begin"], 0.0)
    flow = (over / (1.0 - shape["begin"])) ** shape["power"]
    for gear in np.unique(state.history.specimen):
        rows = state.history.specimen == gear
        flow[rows] = np.maximum.accumulate(flow[rows])
    return -size * state.stiffness * flow


def _flow(rng) -> Shape:
    return {"begin": rng.uniform(0.5, 0.85), "power": rng.uniform(1.0, 1.8)}


def wall(force, state: RigState, size: float, shape: Shape):
    """The wall is eccentric and oval, δ³ in stiffness; size: relative thickness."""
    angle = state.history.angle
    once = shape["once"] * np.cos(angle - shape["first"])
    twice = shape["twice"] * np.cos(2.0 * (angle - shape["second"]))
    thrice = 0.15 * np.cos(3.0 * (angle - shape["third"]))
    return force * ((1.0 + size * (once + twice + thrice)) ** 3 - 1.0)


def _oval(rng) -> Shape:
    return {
        "first": rng.uniform(0.0, 2.0 * np.pi),
        "second": rng.uniform(0.0, 2.0 * np.pi),
        "third": rng.uniform(0.0, 2.0 * np.pi),
        "once": rng.uniform(0.3, 1.0),
        "twice": rng.uniform(0.3, 1.0),
    }


def gears_differ(force, state: RigState, size: float, shape: Shape):
    """Walls of the gears scatter, δ³ in stiffness; size: relative sd of thickness."""
    thickness = 1.0 + size * shape["members"][state.history.specimen]
    return force * (thickness**3 - 1.0)


CONTACT: dict[str, Mechanism] = {
    "seating_slack": Mechanism("table", clearance, 0.12, draw=_seats),
    "contact_bedding": Mechanism(
        "gear", asperities, 0.06, draw=lambda rng: {"load": rng.uniform(0.02, 0.3)}
    ),
    "contact_onset": Mechanism("path", second_stop, 2.0, draw=_stop),
    "progressive_stiffening": Mechanism(
        "gear", contact_line, 15.0, draw=lambda rng: {"power": rng.uniform(0.8, 1.3)}
    ),
    "large_deflection": Mechanism("gear", large_displacement, 0.045),
    "plastic_yield": Mechanism(
        "gear", yielding, 0.08, frozenset({"unloading"}), draw=_flow
    ),
    "ovality": Mechanism("gear", wall, 0.05, frozenset({"angle"}), draw=_oval),
    "specimen_variation": Mechanism(
        "gear", gears_differ, 0.06, frozenset({"specimens"}), draw=draw_members
    ),
}
