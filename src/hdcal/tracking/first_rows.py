"""The first rows of a stream that begins with priors only.

A normal-inverse-gamma prior ties the width of the coefficients to the noise. Where
both are hardly known, as in a gear file, a reading that happens to fall near the
middle would speak for little noise. So for its first rows the noise is a mixture of
known levels, each with its exact linear core; then one core takes over.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from hdcal.tracking.linear_core import LinearCore
from hdcal.tracking.normal_inverse_gamma import (
    FARTHEST,
    half_width,
    match_moments,
    student_sd,
)
from hdcal.tracking.weighted_cores import WeightedCores

_LEVELS, _ROWS = 60, 20


class FirstRows(WeightedCores):
    """A mixture over levels of the noise, to be merged into one core after some rows.

    Args:
        coefficients: draws of the linear coefficients, shape (draw, p).
        variance: draws of σ² [N²], shape (draw,).
    """

    def __init__(self, coefficients: np.ndarray, variance: np.ndarray):
        parts = np.array_split(np.log(np.sort(variance)), _LEVELS)
        self._log_mean = np.array([np.mean(part) for part in parts])
        self._log_within = np.array([np.var(part) for part in parts])
        self._level = np.exp(self._log_mean)
        mean, covariance = np.mean(coefficients, axis=0), np.cov(coefficients.T)
        unit = match_moments(mean, covariance, 0.0, 0.0)
        root = unit.root / np.sqrt(self._level)[:, None, None]
        prior = replace(unit, root=root, rate=unit.shape * self._level)
        super().__init__(prior, np.array([len(part) for part in parts]) / len(variance))

    @property
    def complete(self) -> bool:
        """Whether these rows are over, and one core may take over."""
        return self.rows >= _ROWS

    def log_density(self, t, tail, freedom: float) -> np.ndarray:
        """Return that of a normal law."""
        return -0.5 * np.minimum(-ndtri(tail), FARTHEST) ** 2

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        middle, scale, freedom = self.marginal(index)
        middle, sd = self.mixed(middle, student_sd(scale, freedom))
        return middle, sd, sd * half_width(freedom)

    def merged(self, forget: float) -> LinearCore:
        """Return the one core with the moments of the mixture.

        Args:
            forget: of that core.
        """
        weight = self.weight
        mean = weight @ self.mean
        about = self.mean - mean
        # Within a level of known noise covariances are over that noise.
        within = np.einsum("k,kir,kjr->ij", weight * self._level, self.root, self.root)
        covariance = within + np.einsum("k,ki,kj->ij", weight, about, about)
        log_mean = float(weight @ self._log_mean)
        between = weight @ (self._log_mean - log_mean) ** 2
        log_variance = float(between + weight @ self._log_within)
        prior = match_moments(mean, covariance, log_mean, log_variance)
        return LinearCore(prior, forget)
