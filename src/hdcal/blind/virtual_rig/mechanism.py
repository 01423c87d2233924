"""What can be switched on in the virtual rig: one mechanism of one stage."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hdcal.blind.virtual_rig.history import History

Stage = Literal["table", "gear", "path", "reading"]
Shape = dict[str, Any]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rig:
    """The rig at one stage of its chain.

    Attributes:
        history: what the rig does.
        stiffness: of the gear in each row [N/mm], shape (n,).
        deformation: that the gear sees [mm], shape (n,).
        radius: of the gear's neutral surface [mm].
    """

    history: History
    stiffness: Floats
    deformation: Floats
    radius: float = 40.0


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
        adds: (signal, rig, size, shape) → what it adds to the signal, shape (n,).
        largest: size beyond which it is not plausible on a real rig.
        needs: features of a program without which nobody can tell it.
        draw: draws the shape; random numbers of members are drawn here too.
        signed: whether the size may be negative.
        amplitude: library parameter that has this very meaning, in the same unit.
    """

    stage: Stage
    adds: Callable[[Floats, Rig, float, Shape], Floats]
    largest: float
    needs: frozenset[str] = frozenset()
    draw: Callable[[np.random.Generator], Shape] = field(default=_no_shape)
    signed: bool = False
    amplitude: str = ""
