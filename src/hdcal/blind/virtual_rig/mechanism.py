"""What can be switched on in the virtual rig: one mechanism of one stage."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hdcal.blind.virtual_rig.history import Floats, History

Shape = dict[str, Any]


@dataclass(frozen=True)
class RigState:
    """What a mechanism can see of the rig.

    Attributes:
        history: what the rig does.
        stiffness: of the gear in each row [N/mm], shape (n,).
        deformation: that the gear sees [mm], shape (n,).
    """

    history: History
    stiffness: Floats
    deformation: Floats


def _no_shape(rng: np.random.Generator) -> Shape:
    return {}


@dataclass(frozen=True)
class Mechanism:
    """One mechanism, of which only the size is free once its shape is drawn.

    Stages, in the order in which the rig passes them: `table` adds to the deformation
    that the gear sees [mm], `gear` to its force [N], `path` is a second way for the
    force [N], `reading` adds to what is read [N].

    Attributes:
        stage: where it acts.
        adds: (signal, state, size, shape) → what it adds to the signal, shape (n,).
        largest: size beyond which it is not plausible on a real rig.
        needs: features of a loading without which nobody can tell it.
        draw: draws the shape; random numbers of members are drawn here too.
        signed: whether the size may be negative.
        amplitude: library parameter that has this very meaning, in the same unit.
    """

    stage: Literal["table", "gear", "path", "reading"]
    adds: Callable[[Floats, RigState, float, Shape], Floats]
    largest: float
    needs: frozenset[str] = frozenset()
    draw: Callable[[np.random.Generator], Shape] = field(default=_no_shape)
    signed: bool = False
    amplitude: str = ""


def draw_bend(rng: np.random.Generator) -> Shape:
    """Draw how far a law of temperature is from a straight line [1/K]."""
    return {"bend": rng.uniform(-0.006, 0.006)}


def draw_members(rng: np.random.Generator) -> Shape:
    """Draw a standard size for each of up to 64 mountings or gears, shape (64,)."""
    return {"members": rng.uniform(-1.7, 1.7, 64)}


def bent_line(signal: Floats, state: RigState, size: float, shape: Shape) -> Floats:
    """What grows with temperature, not quite linearly; size: slope to 30 K above."""
    rise = state.history.rise
    return size * rise * (1.0 + shape["bend"] * (rise - 30.0))
