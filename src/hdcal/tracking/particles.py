"""Effects followed row by row: particles that each carry an exact linear core.

A particle fixes what bends the chain (the effects' parameters, α and ω₀) at one draw
of the posterior. Given these the reading is linear in stiffness and zero, which each
particle updates exactly; its weight is the probability it gave the rows so far
(Rao–Blackwell). Particles are never moved or drawn anew: when the rows know the fixed
parameters much better than the posterior did, few keep any weight, and that is told.
"""

from dataclasses import replace

import numpy as np

from hdcal.tracking.normal_inverse_gamma import (
    half_width,
    match_draws,
    square_root,
    student_sd,
)
from hdcal.tracking.weighted_cores import WeightedCores

# Below this effective number of particles their answer rests on a few draws.
LEAST_EFFECTIVE = 5.0


class Particles(WeightedCores):
    """Weighted particles, each with its normal-inverse-gamma law of what is linear.

    The columns of a row are force per unit of stiffness [mm], force at no stiffness
    [N], one, and those of the fitted leftover; the coefficient of the second is known.
    The others of a particle have the law of the draws given what it fixes, from their
    moments.

    Args:
        linear: stiffness [N/mm], zero [N] and weights of the fitted leftover [N] of
            every draw, shape (draw, 2 + weight).
        variance: σ² of a reading [N²], shape (draw,).
        fixed: what particles fix, shape (draw, q).
        chosen: indices of the draws that become particles.
    """

    def __init__(
        self,
        linear: np.ndarray,
        variance: np.ndarray,
        fixed: np.ndarray,
        chosen: np.ndarray,
    ):
        centre, about = fixed - fixed.mean(axis=0), linear - linear.mean(axis=0)
        slope = np.linalg.lstsq(centre, about, rcond=1e-10)[0]
        given = linear.mean(axis=0) + centre[chosen] @ slope
        left = about - centre @ slope
        law = match_draws(linear, variance)
        noise = law.rate / law.shape
        root = square_root(left.T @ left / len(left) / noise)
        mean, root = np.insert(given, 1, 1.0, axis=1), np.insert(root, 1, 0.0, axis=0)
        prior = replace(law, mean=mean, root=root)
        super().__init__(prior, np.full(len(chosen), 1.0 / len(chosen)))

    @property
    def effective(self) -> float:
        """Effective number of particles, 1/Σw²."""
        return float(1.0 / np.sum(self.weight**2))

    def log_density(self, t, tail, freedom: float) -> np.ndarray:
        """Return that of a Student law."""
        return -0.5 * (freedom + 1.0) * np.log1p(t**2 / freedom)

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        middle, scale, freedom = self.marginal(index)
        middle, scale = self.mixed(middle, scale)
        return middle, student_sd(scale, freedom), scale * half_width(freedom)
