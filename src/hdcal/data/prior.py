"""The prior of one parameter, and the full scale of which shipped ones are shares."""

from dataclasses import dataclass

import equinox as eqx
import numpy as np
from jax import Array
from jaxtyping import Float

from hdcal.data.plausible import range_of
from hdcal.data.units import unit_powers

# family -> the numbers it needs, in the order of the distribution's arguments
FAMILIES: dict[str, tuple[str, ...]] = {
    "fixed": ("value",),
    "normal": ("mean", "sd"),
    "lognormal": ("median", "log_sd"),
    "half_normal": ("sd",),
    "uniform": ("low", "high"),
    "beta": ("a", "b"),
}


class Prior(eqx.Module):
    """The prior of one parameter, in code units; numbers as in FAMILIES[family]."""

    family: str = eqx.field(static=True)
    numbers: tuple[Float[Array, ""] | float, ...]
    unit: str = eqx.field(static=True, default="")
    source: str = eqx.field(static=True, default="")


def scaled(prior: Prior, factor) -> Prior:
    """Return the prior of factor × parameter (factor > 0)."""
    if prior.family == "beta":
        raise ValueError("a beta prior cannot be rescaled")
    # A logarithm's spread does not change with the unit.
    numbers = tuple(
        number if size == "log_sd" else number * factor
        for size, number in zip(FAMILIES[prior.family], prior.numbers, strict=True)
    )
    return Prior(prior.family, numbers, prior.unit, prior.source)


@dataclass(frozen=True)
class FullScale:
    """The largest readings of a rig, or their range where that is smaller."""

    # By default those that priors are written for.
    force: float = 100.0  # [N]
    deformation: float = 0.5  # radial [mm]
    slope: float = 200.0  # of both ranges [N/mm]
    zero_sd: float = 5.0  # of the prior of a force zero that is not stated [N]

    def own(self, prior: Prior) -> Prior:
        """Return a shipped prior, written for the default, as it is on this rig."""
        force, length, _, _ = unit_powers(prior.unit or "1")
        ratio = (self.force / REFERENCE.force) ** force
        ratio *= (self.deformation / REFERENCE.deformation) ** length
        # What has no force and no length in it, such as a share, has no scale.
        return prior if ratio == 1.0 else scaled(prior, ratio)

    def own_stiffness(self, prior: Prior) -> Prior:
        """Return the shipped stiffness of a spring on this rig, within its range."""
        known = range_of("spring_stiffness")
        within = min(max(self.slope, known.low), known.high)
        return Prior(prior.family, (within, prior.numbers[1]), prior.unit, prior.source)

    def own_zero(self, prior: Prior) -> Prior:
        """Return the prior of a force zero that nobody states, wide."""
        middle, _ = prior.numbers
        return Prior(prior.family, (middle, self.zero_sd), prior.unit, prior.source)


REFERENCE = FullScale()
_FAR = 10.0  # a zero may lie so many times farther off than what was read goes


def scale_of(force: np.ndarray, deformation: np.ndarray, reading: str) -> FullScale:
    """Return the largest readings; one in a hundred may be wild."""
    radial = deformation * (0.5 if reading == "diametral" else 1.0)
    (largest, width, level), (far, stroke, centre) = map(_reach, (force, radial))
    # Where nothing was read but zeros, nothing is known of the scale.
    largest, far = largest or REFERENCE.force, far or REFERENCE.deformation
    if not (width > 0.0 and stroke > 0.0):
        return FullScale(largest, far, largest / far, _FAR * largest)
    slope = width / stroke
    zero_sd = _FAR * (width + level + slope * centre)
    # An origin far from the readings says nothing of their scale.
    return FullScale(min(largest, width), min(far, stroke), slope, zero_sd)


def _reach(values: np.ndarray) -> tuple[float, float, float]:
    """Return the largest size, the range and the distance of the middle from zero."""
    size = float(np.quantile(np.abs(values), 0.99, method="higher"))
    low = float(np.quantile(values, 0.01, method="lower"))
    high = float(np.quantile(values, 0.99, method="higher"))
    return size, high - low, abs(low + high) / 2.0
