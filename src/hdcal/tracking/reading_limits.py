"""Which numbers can be a reading of a gear, and which of them were tested."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.prediction.engine.pooled import Pooled
from hdcal.tracking.linear_core import STIFFNESS, ZERO
from hdcal.tracking.stream_prior import StreamPrior

_NEAR_K, _NEAR_MM = 1.0, 1e-9
# A gear is hardly stiffer than this quantile, nor so many times as stiff farther on.
_SURE, _STIFFENING = 0.999, 2.0


@dataclass(frozen=True)
class ReadingLimits:
    """What a reading of one gear has to be.

    Attributes:
        radius: of the gear, in the deformation as read [mm].
        hottest: temperature at which half of the modulus is lost [°C].
        strongest: size of a force that no gear needs, twice that at its radius [N].
        needs: what the effects look at.
        tested: ends of deformation [mm] and of temperature [°C], or None.
    """

    radius: float
    hottest: float
    strongest: float
    needs: frozenset[str] = frozenset()
    tested: tuple[float, ...] | None = None

    def check(self, deformation, force, temperature, time) -> None:
        """Refuse numbers that are no reading; what they are says `Tracker.update`.

        Raises:
            ValueError: one is missing, not finite or none of this gear.
        """
        given = {"deformation": deformation, "force": force}
        given |= {"temperature": temperature, "time": time}
        for name, value in given.items():
            if value is None and name in self.needs:
                raise ValueError(f"the {name} is missing, and an effect needs it")
            for wrong in implausible(name, value):
                raise ValueError(f"the {name} of {wrong.problem}")
        if abs(deformation) >= self.radius:
            raise ValueError(
                f"a deformation of {deformation:g} mm is none of this gear"
            )
        if abs(force) > self.strongest:
            raise ValueError(f"a force of {force:g} N is none of this gear")
        if temperature is not None and temperature > self.hottest:
            raise ValueError(f"{temperature:g} °C leaves nothing of the stiffness")

    def were_tested(self, deformation: float, temperature: float) -> bool | None:
        """Return whether the calibration's data hold such rows; None without data."""
        if self.tested is None:
            return None
        low, high, cold, warm = self.tested
        return low <= deformation <= high and cold <= temperature <= warm


def reading_limits(known: Pooled | Gear, prior: StreamPrior) -> ReadingLimits:
    """Return the limits of a gear.

    Args:
        known: what the stream begins with.
        prior: of the stream, from the same.
    """
    gear = known if isinstance(known, Gear) else known.case.gear
    # Where the linear law E(T) has lost half of the modulus; never hotter than that.
    alpha = max(float(np.median(prior.base.alpha)), 1e-5)
    hottest = gear.reference_temperature + 0.5 / alpha
    size = np.quantile(np.abs(prior.coefficients()), _SURE, axis=0)
    strongest = _STIFFENING * size[STIFFNESS] * gear.reach + size[ZERO]
    ends_of_gear = gear.reach, hottest, float(strongest)
    if isinstance(known, Gear):
        return ReadingLimits(*ends_of_gear)
    rows = known.case.records
    low, high = np.min(rows.deformation), np.max(rows.deformation)
    cold, warm = np.min(rows.temperature), np.max(rows.temperature)
    ends = (low - _NEAR_MM, high + _NEAR_MM, cold - _NEAR_K, warm + _NEAR_K)
    needs = frozenset().union(*(effect.needs for effect in known.problem.effects))
    return ReadingLimits(*ends_of_gear, needs, tuple(map(float, ends)))
