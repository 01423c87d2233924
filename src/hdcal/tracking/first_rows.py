"""The first rows of a stream that begins with priors only.

A normal-inverse-gamma prior ties the width of the coefficients to the noise. Where
both are hardly known, as in a gear file, a reading that happens to fall near the
middle would speak for little noise. So for its first rows the noise is a mixture of
known levels, each with its exact linear core; then one core takes over.
"""

import numpy as np
from scipy.special import ndtr

from hdcal.tracking.linear_core import (
    LinearCore,
    Start,
    half_width,
    mixture_score,
    start_from,
)

_LEVELS, _ROWS = 60, 20
# So many degrees of freedom that the noise counts as known.
_KNOWN = 1e8
_WIDTH = half_width(2.0 * _KNOWN)


class Opening:
    """A mixture over levels of the noise that becomes one core after some rows.

    Args:
        coefficients: draws of the linear coefficients, shape (draw, p).
        variance: draws of σ² [N²], shape (draw,).
        forget: of the core that takes over.
    """

    zero = LinearCore.zero

    def __init__(self, coefficients: np.ndarray, variance: np.ndarray, forget: float):
        parts = np.array_split(np.argsort(variance, kind="stable"), _LEVELS)
        logs = [np.log(variance[part]) for part in parts]
        self._log_mean = np.array([np.mean(log) for log in logs])
        self._log_within = np.array([np.var(log) for log in logs])
        self._log_weight = np.log([len(part) / len(variance) for part in parts])
        mean, covariance = np.mean(coefficients, axis=0), np.cov(coefficients.T)
        self._levels = [
            LinearCore(_known_noise(mean, covariance, level))
            for level in self._log_mean
        ]
        self._forget, self._left = forget, _ROWS
        self._core: LinearCore | None = None

    def step(self, columns: list[float], force: float) -> tuple[float, float, float]:
        """Predict a row, then learn from it; as `LinearCore.step`."""
        if self._core is not None:
            return self._core.step(columns, force)
        found = np.array([level.step(columns, force) for level in self._levels])
        middle, sd = found[:, 0], found[:, 1] / _WIDTH
        weight = np.exp(self._log_weight)
        score = mixture_score(
            float(weight @ ndtr(found[:, 2])), float(weight @ ndtr(-found[:, 2]))
        )
        centre, spread = _moments(weight, middle, sd)
        total = self._log_weight - 0.5 * found[:, 2] ** 2 - np.log(sd)
        top = float(np.max(total))
        self._log_weight = total - top - np.log(np.sum(np.exp(total - top)))
        self._left -= 1
        if self._left == 0:
            self._core = self._hand_over()
        return centre, _WIDTH * spread, score

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        if self._core is not None:
            return self._core.coefficient(index)
        found = np.array([level.coefficient(index) for level in self._levels])
        middle, sd = _moments(np.exp(self._log_weight), found[:, 0], found[:, 1])
        return middle, sd, _WIDTH * sd

    def widen(self, index: int, variance: float) -> None:
        """Add variance to one coefficient."""
        for core in self._levels if self._core is None else [self._core]:
            core.widen(index, variance)

    def _hand_over(self) -> LinearCore:
        """Return the one core with the moments of the mixture."""
        weight = np.exp(self._log_weight)
        levels = [level.moments() for level in self._levels]
        means = np.stack([mean for mean, _ in levels])
        # Within a level of known noise covariances are over that noise.
        within = (
            np.stack([c for _, c in levels]) * np.exp(self._log_mean)[:, None, None]
        )
        mean = weight @ means
        about = means - mean
        covariance = np.einsum("k,kij->ij", weight, within)
        covariance += np.einsum("k,ki,kj->ij", weight, about, about)
        log_mean = float(weight @ self._log_mean)
        between = weight @ (self._log_mean - log_mean) ** 2
        log_variance = float(between + weight @ self._log_within)
        start = start_from(mean, covariance, log_mean, log_variance)
        return LinearCore(start, self._forget)


def _known_noise(mean: np.ndarray, covariance: np.ndarray, log_level: float) -> Start:
    start = start_from(mean, covariance, log_level, 0.0)
    return Start(mean, start.root, _KNOWN, _KNOWN * float(np.exp(log_level)))


def _moments(weight, middle, sd) -> tuple[float, float]:
    centre = float(weight @ middle)
    variance = float(weight @ sd**2 + weight @ (middle - centre) ** 2)
    return centre, float(np.sqrt(variance))
