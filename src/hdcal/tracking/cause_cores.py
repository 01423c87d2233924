"""Linear cores for the causes that a calibration averages over, each with its law."""

import numpy as np

from hdcal.tracking.normal_inverse_gamma import (
    NormalInverseGamma,
    half_width,
    match_moments,
    student_sd,
)
from hdcal.tracking.weighted_cores import WeightedCores

# A cause of fewer draws for each number has no law of its own; it goes with the
# likeliest.
_FEWEST = 10


class CauseCores(WeightedCores):
    """Cores whose noise is known by a law: one for each cause, or more.

    A mixture of causes is no normal law: where some have a leftover, the draws of the
    others would say that there is little of it.
    """

    def log_density(self, t, tail, freedom: float) -> np.ndarray:
        """Return that of a Student law."""
        return -0.5 * (freedom + 1.0) * np.log1p(t**2 / freedom)

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        middle, scale, freedom = self.marginal(index)
        middle, scale = self.mixed(middle, scale)
        return middle, student_sd(scale, freedom), scale * half_width(freedom)


def followed_one_by_one(
    coefficients: np.ndarray, variance: np.ndarray, cause: np.ndarray
) -> CauseCores:
    """Return a core for each cause.

    Args:
        coefficients: of the linear columns, shape (draw, p).
        variance: σ² of a reading [N²], shape (draw,).
        cause: number of the cause behind each draw, shape (draw,).
    """
    cause = told_apart(cause, coefficients.shape[1])
    _, first, count = np.unique(cause, return_index=True, return_counts=True)
    nothing = np.empty((len(cause), 0))
    law = laws_given(coefficients, variance, nothing, cause, first)
    return CauseCores(law, count / len(cause))


def told_apart(cause: np.ndarray, numbers: int) -> np.ndarray:
    """Return the causes with rare ones counted as the likeliest, shape (draw,).

    Args:
        cause: number of the cause behind each draw, shape (draw,).
        numbers: that each draw has.
    """
    count = np.bincount(cause)
    return np.where(count[cause] < _FEWEST * numbers, np.argmax(count), cause)


def laws_given(
    linear: np.ndarray,
    variance: np.ndarray,
    fixed: np.ndarray,
    cause: np.ndarray,
    chosen: np.ndarray,
) -> NormalInverseGamma:
    """Return the laws of what is linear, given cause and fixed values of some draws.

    Args:
        linear: coefficients, shape (draw, p).
        variance: σ² of a reading [N²], shape (draw,).
        fixed: what cannot be updated, shape (draw, q).
        cause: number of the cause behind each draw, shape (draw,).
        chosen: indices of draws, shape (core,).
    """
    size, logs = linear.shape[1], np.log(variance)
    middle = {number: np.mean(logs[cause == number]) for number in np.unique(cause)}
    # The noise has one shape, that of all causes about their own middle.
    spread = float(np.var(logs - np.array([middle[number] for number in cause])))
    mean, root = np.empty((len(chosen), size)), np.zeros((len(chosen), size, size))
    shape, rate = 0.0, np.empty(len(chosen))
    for number in np.unique(cause[chosen]):
        of, own = cause == number, cause[chosen] == number
        centre, about = linear[of].mean(axis=0), fixed[of] - fixed[of].mean(axis=0)
        slope, _, rank, _ = np.linalg.lstsq(about, linear[of] - centre, rcond=1e-10)
        left = linear[of] - centre - about @ slope
        covariance = left.T @ left / (np.count_nonzero(of) - 1 - rank)
        law = match_moments(centre, covariance, float(middle[number]), spread)
        mean[own] = centre + (fixed[chosen[own]] - fixed[of].mean(axis=0)) @ slope
        root[own, :, : law.root.shape[1]] = law.root
        shape, rate[own] = law.shape, law.rate
    return NormalInverseGamma(mean, root, shape, rate)
