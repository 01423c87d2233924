"""The calibrated gears of a response: all that motion takes from prediction."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from hdcal.errors import InputError
from hdcal.inference.force_model.priors import without_scatter
from hdcal.inference.force_model.problem import MEMBERS
from hdcal.inference.force_model.values import Values
from hdcal.physics.theory import Scalar
from hdcal.prediction import conditions
from hdcal.prediction.joint import joint
from hdcal.prediction.models import Models, averaging_words
from hdcal.prediction.simulate import gear_leftover

__all__ = ["CalibratedGears", "Models", "leftover_force"]
# Members of what was tested, which may be many and are no part of a gear in motion.
_LEFT_OUT = {*MEMBERS.values()}
# The leftover of a draw at so many places, up to this multiple of the largest tested
# deformation either way. A cubic spline between them keeps the integration smooth.
_PLACES, _REACH = 121, 3.0
# Sites of a draw: the ends of the spline [mm], and its coefficients, highest first.
_ENDS, _LEFTOVER = "_leftover_ends", "_leftover"


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
        self._joint = whole = joint(models)
        self._models = models
        self.posterior = whole.posterior
        self.moving = whole.posterior.kind == "dynamic"
        self.effects = without_scatter(whole.effects)
        gap = None if self.moving else whole.problem.discrepancy
        self.is_looped = gap is not None and gap.looped
        self.averaging = averaging_words(models)

    def temperature(self, asked: float | None) -> float:
        """Return a temperature, by default the tested one nearest to the reference.

        Raises:
            InputError: it is impossible.
        """
        case, values = self.posterior.case, self._joint.draws
        if asked is None:
            return conditions.usual_temperature(case)
        levels = np.array([asked])
        if wrong := conditions.temperature_findings(case.gear, values, levels):
            raise InputError(wrong)
        return float(asked)

    def tested(self, temperature: float, low, high) -> np.ndarray:
        """Return where the deformation of a band [mm] and a temperature were tested."""
        records, slack = self.posterior.case.records, conditions.NEAR_MM
        offset = np.median(self._joint.draws["deformation_offset"])
        # Motion begins at the unloaded gear.
        reached = np.append(records.deformation - offset, 0.0)
        inside = (low >= reached.min() - slack) & (high <= reached.max() + slack)
        return inside & conditions.temperature_is_tested(records, temperature)

    def draw(self, count: int, seed: int) -> dict[str, np.ndarray]:
        """Return so many draws of one gear, those at rest with their leftover.

        The seed is that of the bend.
        """
        few = joint(self._models, count)
        values = {n: v for n, v in few.draws.items() if n not in _LEFT_OUT}
        if self.moving:
            return values
        far = _REACH * float(np.max(np.abs(self.posterior.case.records.deformation)))
        places = np.linspace(-far, far, _PLACES)
        spline = CubicSpline(places, gear_leftover(few, places, seed=seed), axis=1)
        ends = np.tile(places[[0, -1]], (few.size, 1))
        return values | {_ENDS: ends, _LEFTOVER: np.moveaxis(spline.c, 2, 0)}


def leftover_force(value: Values) -> Callable[[Scalar], Scalar] | None:
    """Return the part of the force of one draw that base and effects lack.

    It is the fitted leftover, the mean of loading and unloading, and the bend: from a
    deformation as read from the unloaded gear [mm] to a force [N], zero at the unloaded
    gear. None of a gear that was calibrated in motion.

    Args:
        value: one draw, from `CalibratedGears.draw`.
    """
    if _LEFTOVER not in value:
        return None

    def leftover(deformation: Scalar) -> Scalar:
        low, high = value[_ENDS]
        width = (high - low) / (_PLACES - 1)
        place = jnp.clip(deformation, low, high) - low
        part = jnp.clip(jnp.floor(place / width), 0, _PLACES - 2).astype(int)
        return jnp.polyval(value[_LEFTOVER][:, part], place - part * width)

    unloaded = leftover(0.0)
    return lambda deformation: leftover(deformation) - unloaded
