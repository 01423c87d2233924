"""Effects followed row by row: particles that each carry an exact linear core.

A particle fixes what bends the chain (the effects' parameters, α and ω₀) at one draw
of the posterior. Given these the reading is linear in stiffness and zero, which each
particle updates exactly; its weight is the probability it gave the rows so far
(Rao–Blackwell). Particles are never moved or drawn anew: when the rows know the fixed
parameters much better than the posterior did, few keep any weight, and that is told.
"""

from collections.abc import Callable

import numpy as np
from scipy.special import gammaln, stdtr

from hdcal.tracking.linear_core import half_width, mixture_score, student_sd

# Below this effective number of particles their answer rests on a few draws.
LEAST_EFFECTIVE = 5.0
# Of each particle: force at no stiffness [N], and force per unit of stiffness [mm].
Features = tuple[np.ndarray, np.ndarray]
# (deformation, temperature rise, time) -> features of the row.
Mean = Callable[[float, float, float], Features]


class ParticleCore:
    """Weighted particles, each with its normal-inverse-gamma stiffness and zero.

    Args:
        mean: of stiffness and zero of each particle, shape (particle, 2).
        spread: their common covariance over σ², shape (2, 2).
        shape: of the noise variance [-].
        rate: of the noise variance [N²].
    """

    zero = 1

    def __init__(self, mean: np.ndarray, spread: np.ndarray, shape: float, rate: float):
        size = len(mean)
        self.mean = mean.copy()
        self.spread = np.repeat(spread[None], size, axis=0)
        self.shape, self.rate = shape, np.full(size, rate)
        self._log_weight = np.full(size, -np.log(size))

    @property
    def weight(self) -> np.ndarray:
        """Probability of each particle."""
        return np.exp(self._log_weight)

    @property
    def effective(self) -> float:
        """Effective number of particles, 1/Σw²."""
        return float(1.0 / np.sum(self.weight**2))

    def step(self, features: Features, force: float) -> tuple[float, float, float]:
        """Predict a row from the rows before it, then learn from it.

        Args:
            features: of the row.
            force: reading [N].

        Returns:
            Mean [N] and half-width of the 95 % interval [N] of the predictive
            mixture, taken as a Student law of its mean and variance, and the normal
            score of the reading in the mixture itself.
        """
        rest, slope = features
        # The row of each particle is (slope, 1).
        gain = slope[:, None] * self.spread[:, 0] + self.spread[:, 1]
        wide = 1.0 + slope * gain[:, 0] + gain[:, 1]
        expected = rest + slope * self.mean[:, 0] + self.mean[:, 1]
        error, scale = force - expected, np.sqrt(self.rate / self.shape * wide)
        freedom = 2.0 * self.shape
        t, weight = error / scale, self.weight
        middle, half = self._mixture(expected, scale)[::2]
        below, above = stdtr(freedom, t), stdtr(freedom, -t)
        score = mixture_score(float(weight @ below), float(weight @ above))
        self._learn(t, scale, freedom)
        self.mean += gain * (error / wide)[:, None]
        self.spread -= gain[:, :, None] * (gain / wide[:, None])[:, None, :]
        self.rate += 0.5 * error**2 / wide
        self.shape += 0.5
        return middle, half, score

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        variance = self.rate / self.shape * self.spread[:, index, index]
        return self._mixture(self.mean[:, index], np.sqrt(variance))

    def widen(self, index: int, variance: float) -> None:
        """Add variance to stiffness (0) or zero (1); it may have moved.

        Args:
            index: of the coefficient.
            variance: to add, in the square of its unit.
        """
        self.spread[:, index, index] += variance / (self.rate / self.shape)

    def _mixture(self, places, scales) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a mixture."""
        weight, freedom = self.weight, 2.0 * self.shape
        middle = float(weight @ places)
        between = float(weight @ (places - middle) ** 2)
        scale = float(np.sqrt(weight @ scales**2 + between))
        return middle, student_sd(scale, freedom), scale * half_width(freedom)

    def _learn(self, t, scale, freedom: float) -> None:
        constant = gammaln(0.5 * (freedom + 1.0)) - gammaln(0.5 * freedom)
        constant -= 0.5 * np.log(freedom * np.pi)
        log = constant - 0.5 * (freedom + 1.0) * np.log1p(t**2 / freedom)
        total = self._log_weight + log - np.log(scale)
        top = float(np.max(total))
        self._log_weight = total - top - np.log(np.sum(np.exp(total - top)))


def conditional(
    linear: np.ndarray, fixed: np.ndarray, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the law of some parameters given others, from the moments of draws.

    Args:
        linear: stiffness and zero of every draw, shape (draw, 2).
        fixed: what particles fix, shape (draw, q).
        chosen: indices of the draws that become particles.

    Returns:
        Mean of each particle, shape (particle, 2), and the common covariance.
    """
    centre = fixed - fixed.mean(axis=0)
    about = linear - linear.mean(axis=0)
    slope = np.linalg.lstsq(centre, about, rcond=1e-10)[0]
    left = about - centre @ slope
    return linear.mean(axis=0) + centre[chosen] @ slope, left.T @ left / len(left)
