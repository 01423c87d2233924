"""How a rig writes its readings: at which scale, and in which form of numbers."""

import math
from dataclasses import dataclass

import numpy as np

from hdcal.blind.virtual_rig.history import FULL

# Force at the largest deformation of the rigs as they are simulated [N], about.
_FULL_FORCE = 0.5 * (150.0 + 260.0) * FULL
# Full scales of the rigs that people have.
_FORCES, _DEFORMATIONS = (5.0, 50e3), (0.05, 20.0)


@dataclass(frozen=True)
class Writing:
    """What turns the simulated readings into those of a file.

    Attributes:
        force: newtons in the file for each newton of the simulation.
        deformation: the same of millimetres.
        force_form: how a force is written.
        deformation_form: how a deformation is written.
    """

    force: float = 1.0
    deformation: float = 1.0
    force_form: str = ".4f"
    deformation_form: str = ".5f"


AS_SIMULATED = Writing()


def draw_writing(rng: np.random.Generator) -> Writing:
    """Draw the full scales of a rig, and what its logger keeps: digits or decimals."""
    force, deformation = (
        math.exp(rng.uniform(*np.log(ends))) for ends in (_FORCES, _DEFORMATIONS)
    )
    forms = ".6g", ".6g"
    if rng.uniform() < 0.5:
        forms = tuple(f".{_decimals(full)}f" for full in (force, deformation))
    return Writing(force / _FULL_FORCE, deformation / FULL, *forms)


def _decimals(full_scale: float) -> int:
    """Return so many that the last one is far below any noise: 1e-4 of full scale."""
    return max(0, 4 - math.floor(math.log10(full_scale)))
