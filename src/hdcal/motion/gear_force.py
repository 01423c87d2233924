"""The calibrated gears of a response: all that motion takes from prediction.

What replaces the engine has to provide `CalibratedGears`, and `leftover_force`, which
returns a function for JAX.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hdcal.errors import InputError
from hdcal.inference.members import MEMBERS
from hdcal.inference.problem import Problem, without_scatter
from hdcal.inference.values import Values
from hdcal.physics.theory import Scalar
from hdcal.prediction.engine import conditions, gear_forces
from hdcal.prediction.engine.causes import averaging_words
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import pool
from hdcal.prediction.engine.untested import Bends

__all__ = ["CalibratedGears", "Models", "leftover_force"]
# Members of what was tested, which may be many and are no part of a gear in motion.
_LEFT_OUT = {*MEMBERS.values()} - {"gap_weights"}


class CalibratedGears:
    """Calibrated models of one gear, averaged over.

    Attributes:
        posterior: the most probable model, with data and gear.
        moving: whether the gear was calibrated in motion.
        effects: of all models.
        is_looped: whether the leftover differs between loading and unloading.
        averaging: sentences about the models that are averaged over.

    Raises:
        NotUsable: a calibration failed its checks.
    """

    def __init__(self, models: Models):
        self._pooled = pooled = pool(models)
        self.posterior, self.moving = pooled.causes[0].posterior, pooled.moving
        self.effects = without_scatter(pooled.effects)
        gap = None if pooled.moving else pooled.problem.discrepancy
        self.is_looped = gap is not None and gap.looped
        self.averaging = averaging_words(pooled.causes)

    def temperature(self, asked: float | None) -> float:
        """Return a temperature, by default the tested one nearest to the reference.

        Raises:
            InputError: it is impossible.
        """
        case, values = self.posterior.case, self._pooled.values
        if asked is None:
            return conditions.usual_temperature(case)
        levels = np.array([asked])
        if wrong := conditions.temperature_findings(case.gear, values, levels):
            raise InputError(wrong)
        return float(asked)

    def tested(self, temperature: float, low, high) -> np.ndarray:
        """Return where the deformation of a band [mm] and a temperature were tested."""
        records, slack = self.posterior.case.records, conditions.NEAR_MM
        offset = np.median(self._pooled.values["deformation_offset"])
        # Motion begins at the unloaded gear.
        reached = np.append(records.deformation - offset, 0.0)
        inside = (low >= reached.min() - slack) & (high <= reached.max() + slack)
        return inside & conditions.temperature_is_tested(records, temperature)

    def draw(self, count: int, seed: int) -> tuple[dict[str, np.ndarray], Any]:
        """Return so many draws of one gear, and the structure of their leftover.

        The seed is that of the bend beyond the tested range.
        """
        pooled = self._pooled
        if self.moving:
            kept = gear_forces.evenly(len(pooled.index), count)
            return {name: v[kept] for name, v in pooled.values.items()}, None
        values, untested = gear_forces.gear_values(pooled, seed, count)
        values = {name: v for name, v in values.items() if name not in _LEFT_OUT}
        return values, (pooled.problem, untested)


def leftover_force(structure: Any, value: Values) -> Callable[[Scalar], Scalar] | None:
    """Return the part of the force of one draw that base and effects lack.

    It is the fitted leftover, the mean of loading and unloading, with the bend beyond
    the tested range: from a deformation as read from the unloaded gear [mm] to a force
    [N], zero at the unloaded gear.

    Args:
        structure: from `CalibratedGears.draw`; None gives None.
        value: one draw.
    """
    if structure is None:
        return None
    problem, untested = structure
    leftover = _Leftover(problem, value, gear_forces.gear_bends(untested, value))
    return _Leftover(problem, value, leftover.bends, leftover(0.0))


class _Leftover(eqx.Module):
    problem: Problem
    value: Values
    bends: Bends
    unloaded: Scalar = 0.0

    def __call__(self, deformation: Scalar) -> Scalar:
        draw, place = (self.problem, self.value, self.bends), jnp.array([deformation])
        left = gear_forces.gear_leftover(*draw, place, jnp.zeros(1))
        return left[0] - self.unloaded
