"""Mechanisms of load paths beside the gear's bending: stops, friction, oil, creep."""

import numpy as np

from hdcal.blind.virtual_rig.history import FULL
from hdcal.blind.virtual_rig.mechanism import Mechanism, RigState, Shape


def second_stop(force, state: RigState, size: float, shape: Shape):
    """A second stop is touched and stiffens as its spots flatten; size: k₂/k."""
    depth = state.deformation - shape["onset"]
    width = shape["round"]
    depth = width * np.logaddexp(0.0, depth / width)
    return size * state.stiffness * FULL * (depth / FULL) ** shape["power"]


def _stop(rng) -> Shape:
    onset, power = rng.uniform(0.15, 0.42), rng.uniform(1.0, 1.3)
    return {"onset": onset, "power": power, "round": rng.uniform(0.002, 0.02)}


def _dahl(state: RigState, reach: float) -> np.ndarray:
    """Friction over its largest, with a short elastic way before it slips.

    Dahl (1968): dz = (1 − sgn(dx) z) dx / reach.
    """
    x, z = state.deformation, np.zeros(len(state.deformation))
    last, before = 0.0, 0.0
    for row, (here, begins) in enumerate(zip(x, state.history.run_starts, strict=True)):
        last, before = (0.0, 0.0) if begins else (last, before)
        way = here - before
        target = np.sign(way)
        last = target + (last - target) * np.exp(-abs(way) / reach) if way else last
        z[row], before = last, here
    return z


def guide(force, state: RigState, size: float, shape: Shape):
    """Friction of the guide; size [N]."""
    return size * _dahl(state, shape["reach"])


def wedge(force, state: RigState, size: float, shape: Shape):
    """Friction of contacts that the gear's own force presses; size: coefficient."""
    return size * np.abs(force) * _dahl(state, shape["reach"])


def _short(rng) -> Shape:
    return {"reach": rng.uniform(0.002, 0.008)}


def sliding_cells(force, state: RigState, size: float, shape: Shape):
    """Maxwell-slip cells of unequal strength; size: force when all of them slip [N]."""
    reach, share = shape["reach"], shape["share"]
    stretch, before = np.zeros(len(reach)), 0.0
    total = np.zeros(len(force))
    for row, (here, begins) in enumerate(
        zip(state.deformation, state.history.run_starts, strict=True)
    ):
        if begins:
            stretch, before = np.zeros(len(reach)), 0.0
        stretch = np.clip(stretch + here - before, -reach, reach)
        total[row], before = share @ (stretch / reach), here
    return size * total


def _cells(rng) -> Shape:
    longest = np.exp(rng.uniform(np.log(0.08), np.log(0.35)))
    reach = longest * np.sort(rng.uniform(0.05, 1.0, 9))
    return {"reach": reach, "share": rng.dirichlet(np.full(9, 3.0))}


def oil_film(force, state: RigState, size: float, shape: Shape):
    """Shear-thinning oil, F = c sgn(v) |v|ᵐ; size: force at 0.04 mm/s [N]."""
    history = state.history
    step = np.diff(history.deformation, prepend=0.0)
    seconds = np.diff(history.time, prepend=0.0)
    seconds = np.where(history.run_starts | (seconds <= 0.0), np.inf, seconds)
    speed = step / seconds / 0.04
    return size * np.sign(speed) * np.abs(speed) ** shape["thinning"]


def solid(force, state: RigState, size: float, shape: Shape):
    """Three Prony arms over a decade and a half; size: share that relaxes."""
    starts, time = state.history.run_starts, state.history.time
    lost = np.zeros(len(force))
    tau = shape["tau"] * np.array([0.2, 1.0, 5.0])
    held, before, then = np.zeros(3), 0.0, 0.0
    drive = state.stiffness * state.deformation
    for row in range(len(force)):
        if starts[row]:
            held, before, then = np.zeros(3), 0.0, time[row]
        decay = np.exp(-(time[row] - then) / tau)
        held = held * decay + (drive[row] - before) * 0.5 * (1.0 + decay)
        lost[row] = drive[row] - shape["share"] @ held
        before, then = drive[row], time[row]
    return -size * lost


def _arms(rng) -> Shape:
    tau = np.exp(rng.uniform(np.log(8.0), np.log(150.0)))
    return {"tau": tau, "share": rng.dirichlet([1.5, 4.0, 1.5])}


PATHS: dict[str, Mechanism] = {
    "contact_onset": Mechanism("path", second_stop, 2.0, draw=_stop),
    "coulomb_friction": Mechanism(
        "path",
        guide,
        6.0,
        frozenset({"unloading"}),
        draw=_short,
        amplitude="coulomb_friction.force",
    ),
    "load_friction": Mechanism(
        "path",
        wedge,
        0.2,
        frozenset({"unloading"}),
        draw=_short,
        amplitude="load_friction.share",
    ),
    "hysteresis": Mechanism(
        "path", sliding_cells, 10.0, frozenset({"unloading"}), draw=_cells
    ),
    "viscous_damping": Mechanism(
        "path",
        oil_film,
        5.0,
        frozenset({"rates", "time", "unloading"}),
        draw=lambda rng: {"thinning": rng.uniform(0.75, 1.0)},
    ),
    "relaxation": Mechanism(
        "path", solid, 0.15, frozenset({"time", "holds or rates"}), draw=_arms
    ),
}
