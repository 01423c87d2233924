"""Mechanisms of the displacement gauge, the amplifier and the mounting's zero."""

import numpy as np

from benchmarks.blind.rig.history import FULL
from benchmarks.blind.rig.virtual_rig import Mechanism, RigState, Shape, draw_members


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
    return {
        "phase": rng.uniform(0.0, 2.0 * np.pi),
        "other": rng.uniform(0.0, 2.0 * np.pi),
        "pitch": np.exp(rng.uniform(np.log(0.25), np.log(0.6))),
        "second": rng.uniform(0.0, 0.3),
        "wear": rng.uniform(-0.3, 0.3),
    }


def clipping(force, state: RigState, size: float, shape: Shape):
    """The amplifier compresses near its limit; size: full scale over the limit."""
    place = size * np.abs(force) / (np.mean(state.stiffness) * FULL)
    return force * ((1.0 + place ** shape["power"]) ** (-1.0 / shape["power"]) - 1.0)


def remounting(force, state: RigState, size: float, shape: Shape):
    """Every mounting has another zero; size: sd [N]."""
    return size * shape["members"][state.history.run]


SENSOR: dict[str, Mechanism] = {
    "displacement_nonlinearity": Mechanism(
        "table",
        transducer,
        0.03,
        draw=lambda rng: {"cubic": rng.uniform(-0.3, 0.3)},
        signed=True,
    ),
    "screw_error": Mechanism("table", lead_screw, 0.015, draw=_screw),
    "force_saturation": Mechanism(
        "reading", clipping, 0.6, draw=lambda rng: {"power": rng.uniform(1.7, 2.6)}
    ),
    "run_offset": Mechanism(
        "reading", remounting, 6.0, frozenset({"runs"}), draw=draw_members
    ),
}
