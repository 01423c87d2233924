"""What readings of a stream have beside the model, and what makes them unequal."""

from dataclasses import dataclass

import numpy as np

from hdcal.physics.effects.noise import HeteroscedasticNoise
from hdcal.prediction.engine.pooled import Pooled
from hdcal.prediction.engine.untested_reading import UntestedReading
from hdcal.tracking.stream_prior import StreamPrior


@dataclass(frozen=True)
class RowTerms:
    """What one reading has beside the model and the usual noise.

    Attributes:
        shift: mean of what is added [N].
        columns: of unknowns that readings share, shape (UNKNOWNS,) [N]; None where
            the conditions were tested.
        noise: variance of its own over the usual one of a reading [-].
        rest: likewise, of what is no noise [-].
    """

    shift: float = 0.0
    columns: np.ndarray | None = None
    noise: float = 1.0
    rest: float = 0.0

    @property
    def weight(self) -> float:
        """By which the row is multiplied, to be like others."""
        return (self.noise + self.rest) ** -0.5


class UnequalRows:
    """What each reading has beside the model and the usual noise.

    Args:
        known: draws of all causes.
        prior: of the stream, from the same.
    """

    def __init__(self, known: Pooled, prior: StreamPrior):
        self._untested = UntestedReading(known)
        self._variance = float(np.mean(prior.variance))
        share = known.values.get(f"{HeteroscedasticNoise.name}.share")
        sd = 0.0 if share is None else share * prior.coefficients()[:, 0]
        self._growth = float(np.mean(sd**2)) / self._variance

    def at(
        self, deformation: float, temperature: float, *, tested: bool | None
    ) -> RowTerms:
        """Return the terms of a row.

        Args:
            deformation: as read [mm].
            temperature: of the specimen [°C].
            tested: whether the calibration's data hold such rows.
        """
        noise = 1.0 + self._growth * deformation**2
        loop = self._untested.half_loop(deformation) / self._variance
        if tested:
            return RowTerms(noise=noise, rest=loop)
        added = self._untested.at(deformation, temperature)
        rest = added.rest**2 / self._variance + loop
        return RowTerms(added.shift, added.columns, noise, rest)

    def leftover(self, deformation: np.ndarray) -> np.ndarray:
        """Return columns of the weights of the fitted leftover, shape (n, weight).

        Args:
            deformation: as read [mm], shape (n,).
        """
        return self._untested.leftover(deformation)
