"""The full scale of a rig, of which shipped priors in newtons and mm are shares."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.plausible import range_of
from hdcal.data.prior import Prior, scaled
from hdcal.data.units import unit_powers


@dataclass(frozen=True)
class FullScale:
    """The largest readings of a rig; by default those that priors are written for.

    Attributes:
        force: largest force [N].
        deformation: largest radial deformation [mm].
    """

    force: float = 100.0
    deformation: float = 0.5

    def own(self, prior: Prior) -> Prior:
        """Return a shipped prior, written for the default, as it is on this rig."""
        force, length, _, _ = unit_powers(prior.unit or "1")
        ratio = (self.force / REFERENCE.force) ** force
        ratio *= (self.deformation / REFERENCE.deformation) ** length
        # What has no force and no length in it, such as a share, has no scale.
        return prior if ratio == 1.0 else scaled(prior, ratio)

    def own_stiffness(self, prior: Prior) -> Prior:
        """Return the shipped stiffness of a spring as `own` does, within its range."""
        median, log_sd = self.own(prior).numbers
        known = range_of("spring_stiffness")
        within = min(max(float(median), known.low), known.high)
        return Prior(prior.family, (within, log_sd), prior.unit, prior.source)


REFERENCE = FullScale()


def scale_of(force: np.ndarray, deformation: np.ndarray, reading: str) -> FullScale:
    """Return the largest readings; one in a hundred may be wild.

    Args:
        force: shape (n,) [N].
        deformation: as read, shape (n,) [mm].
        reading: of the deformation, `radial` or `diametral`.
    """
    largest, far = (
        float(np.quantile(np.abs(values), 0.99, method="higher"))
        for values in (force, deformation)
    )
    radial = far * (0.5 if reading == "diametral" else 1.0)
    # Where nothing was read but zeros, nothing is known of the scale.
    return FullScale(largest or REFERENCE.force, radial or REFERENCE.deformation)
