"""Mechanisms that open a loop between loading and unloading."""

import numpy as np

from benchmarks.blind.rig.virtual_rig import Mechanism, RigState, Shape


def _dahl(state: RigState, reach: float) -> np.ndarray:
    """Friction over its largest, with a short elastic displacement before slip.

    Dahl (1968): dz = (1 − sgn(dx) z) dx / reach.
    """
    x, z = state.deformation, np.zeros(len(state.deformation))
    last, before = 0.0, 0.0
    for row, (here, begins) in enumerate(zip(x, state.history.run_starts, strict=True)):
        last, before = (0.0, 0.0) if begins else (last, before)
        target = np.sign(here - before)
        if target:
            last = target + (last - target) * np.exp(-abs(here - before) / reach)
        z[row], before = last, here
    return z


def guide(force, state: RigState, size: float, shape: Shape):
    """Friction of the guide; size [N]."""
    return size * _dahl(state, shape["reach"])


def wedge(force, state: RigState, size: float, shape: Shape):
    """Friction of contacts pressed by the force of the gear; size: coefficient."""
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
    seconds = np.where(history.steps > 0.0, history.steps, np.inf)
    speed = step / seconds / 0.04
    return size * np.sign(speed) * np.abs(speed) ** shape["thinning"]


LOOPS: dict[str, Mechanism] = {
    "coulomb_friction": Mechanism(
        "path",
        guide,
        6.0,
        frozenset({"unloading"}),
        draw=_short,
    ),
    "load_friction": Mechanism(
        "path",
        wedge,
        0.2,
        frozenset({"unloading"}),
        draw=_short,
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
}
