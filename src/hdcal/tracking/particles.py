"""Effects followed row by row: particles that each carry an exact linear core.

A particle fixes what bends the chain (the effects' parameters, α and ω₀) at one draw
of the posterior. Given these the reading is linear in stiffness and zero, which each
particle updates exactly; its weight is the probability it gave the rows so far
(Rao–Blackwell). Particles are never moved or drawn anew: when the rows know the fixed
parameters much better than the posterior did, few keep any weight, and that is told.
"""

from dataclasses import replace

import numpy as np

from hdcal.tracking.cause_cores import CauseCores, laws_given, told_apart

# Below this effective number of particles their answer rests on a few draws.
LEAST_EFFECTIVE = 5.0


class Particles(CauseCores):
    """Weighted particles, each with its normal-inverse-gamma law of what is linear.

    The columns of a row are force per unit of stiffness [mm], force at no stiffness
    [N], one, and those of the fitted leftover; the coefficient of the second is known.
    The others of a particle have the law of its cause's draws given what it fixes, from
    their moments.

    Args:
        linear: stiffness [N/mm], zero [N] and weights of the fitted leftover [N] of
            every draw, shape (draw, 2 + weight).
        variance: σ² of a reading [N²], shape (draw,).
        fixed: what particles fix, shape (draw, q).
        cause: number of the cause behind each draw, shape (draw,).
        chosen: indices of the draws that become particles.
    """

    def __init__(
        self,
        linear: np.ndarray,
        variance: np.ndarray,
        fixed: np.ndarray,
        cause: np.ndarray,
        chosen: np.ndarray,
    ):
        cause = told_apart(cause, linear.shape[1] + fixed.shape[1])
        law = laws_given(linear, variance, fixed, cause, chosen)
        mean = np.insert(law.mean, 1, 1.0, axis=1)
        root = np.insert(law.root, 1, 0.0, axis=1)
        prior = replace(law, mean=mean, root=root)
        super().__init__(prior, np.full(len(chosen), 1.0 / len(chosen)))

    @property
    def effective(self) -> float:
        """Effective number of particles, 1/Σw²."""
        return float(1.0 / np.sum(self.weight**2))
