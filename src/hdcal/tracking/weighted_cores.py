"""Linear cores side by side, each weighted by how well it predicted the rows so far."""

from abc import ABC, abstractmethod
from math import sqrt

import numpy as np
from scipy.special import ndtri, stdtr

from hdcal.tracking.linear_core import LinearCores
from hdcal.tracking.normal_inverse_gamma import FARTHEST, NormalInverseGamma, half_width


class WeightedCores(LinearCores, ABC):
    """A mixture of linear cores that differ in what a row cannot update.

    Args:
        prior: what each core knows before the first row.
        weight: probability of each core, shape (core,).

    Attributes:
        weight: probability of each core, given the rows so far.
        rows: how many were learned.
    """

    def __init__(self, prior: NormalInverseGamma, weight: np.ndarray):
        super().__init__(prior)
        # A core that predicted badly keeps a logarithm, and may come back.
        self.weight, self._log_weight = weight, np.log(weight)
        self.rows = 0

    @abstractmethod
    def log_density(
        self, t: np.ndarray, tail: np.ndarray, freedom: float
    ) -> np.ndarray:
        """Return the log density of a row under each core, less common terms.

        Args:
            t: where the reading lies in the Student law of each.
            tail: probability beyond it, away from the middle.
            freedom: degrees of freedom.
        """

    def step(
        self, columns: np.ndarray, force: float, weight: float = 1.0
    ) -> tuple[float, float, float]:
        """Predict a row from the rows before it, then learn from it.

        Args:
            columns: of the linear coefficients, shape (p,) or (core, p).
            force: reading [N].
            weight: of what the row says, 0 to 1.

        Returns:
            Mean [N] and half-width of the 95 % interval [N] of the predictive
            mixture, taken as a Student law of its mean and variance, and the normal
            score of the reading in the mixture itself.
        """
        expected, scale, freedom = self.learn(columns, force, weight)
        t = (force - expected) / scale
        tail = stdtr(freedom, -np.abs(t))
        middle, spread = self.mixed(expected, scale)
        score = _normal_score(self.weight, t, tail)
        density = self.log_density(t, tail, freedom) - np.log(scale)
        log = self._log_weight + weight * density
        log -= log.max()
        likely = np.exp(log)
        total = likely.sum()
        self.weight, self._log_weight = likely / total, log - np.log(total)
        self.rows += 1
        return middle, spread * half_width(freedom), score

    def variance(self) -> float:
        """Return that of a reading, its coefficients known [N²]."""
        return float(np.sum(self.weight * (self.rate / self.shape)))

    def expect(self, columns: np.ndarray) -> float:
        """Return the force that the coefficients give at a row [N]."""
        return float(self.weight @ np.vecdot(columns, self.mean))

    def mixed(
        self, middle: np.ndarray, spread: np.ndarray | float
    ) -> tuple[float, float]:
        """Return centre and spread of a mixture of laws with these."""
        centre = float(self.weight @ middle)
        variance = float(self.weight @ (spread**2 + (middle - centre) ** 2))
        return centre, sqrt(variance)


def _normal_score(weight: np.ndarray, t: np.ndarray, tail: np.ndarray) -> float:
    """Return the standard normal score of a reading in the mixture."""
    high = t > 0.0
    above = float(weight @ np.where(high, tail, 1.0 - tail))
    below = float(weight @ np.where(high, 1.0 - tail, tail))
    # The smaller tail still has its digits.
    score = float(ndtri(below)) if below < above else -float(ndtri(above))
    return max(-FARTHEST, min(FARTHEST, score))
