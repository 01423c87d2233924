"""What is known of linear coefficients and their noise, as a normal-inverse-gamma law.

Readings y = x·β + e, e ~ N(0, σ²), with β | σ² ~ N(m, σ² L Lᵀ) and σ² inverse gamma
with shape a and rate b. Of the noise variance unknown, a reading, like a coefficient,
has a Student distribution with 2a degrees of freedom.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import copysign, inf, sqrt

import numpy as np
import scipy
from scipy.special import digamma, ndtri, polygamma, stdtr, stdtrit

# Directions of relative variance below this were never free, as with a fixed prior.
_NO_VARIANCE = 1e-13
# With this shape the noise counts as known.
MOST_SHAPE = 1e8
LEVEL = 0.95
# A normal score beyond this has no probability left in double precision.
FARTHEST = 37.0


@dataclass(frozen=True)
class NormalInverseGamma:
    """The law of coefficients and noise variance, or of those of many cores.

    Attributes:
        mean: m, shape (p,) or (core, p).
        root: L, shape (p, r) or (core, p, r); what cannot vary has no column, or an
            empty one.
        shape: a [-].
        rate: b [N²], a number or shape (core,).
    """

    mean: np.ndarray
    root: np.ndarray
    shape: float
    rate: float | np.ndarray


def match_draws(coefficients: np.ndarray, variance: np.ndarray) -> NormalInverseGamma:
    """Return the law with the moments of draws.

    Mean and covariance of the coefficients are those of the draws, mean and variance
    of log σ² likewise; that σ² and coefficients depend on each other, and any skew,
    is lost.

    Args:
        coefficients: of the linear columns, shape (draw, p).
        variance: σ² of a reading [N²], shape (draw,).
    """
    logs = np.log(variance)
    return match_moments(
        np.mean(coefficients, axis=0),
        np.cov(coefficients, rowvar=False),
        float(np.mean(logs)),
        float(np.var(logs)),
    )


def match_moments(
    mean: np.ndarray, covariance: np.ndarray, log_mean: float, log_variance: float
) -> NormalInverseGamma:
    """Return the law with these moments.

    Args:
        mean: of the coefficients, shape (p,).
        covariance: of the coefficients, shape (p, p).
        log_mean: of log σ².
        log_variance: of log σ².
    """
    shape = _shape(log_variance)
    rate = float(np.exp(log_mean + digamma(shape)))
    # The mean of σ², where it has one that says something.
    noise = rate / (shape - 1.0) if shape > 2.0 else rate / shape
    return NormalInverseGamma(mean, square_root(covariance / noise), shape, rate)


def square_root(covariance: np.ndarray) -> np.ndarray:
    """Return L with L Lᵀ = covariance, shape (p, r) for a covariance of rank r."""
    sd = np.sqrt(np.diag(covariance))
    unit = np.where(sd > 0.0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    free = values > _NO_VARIANCE
    return unit[:, None] * vectors[:, free] * np.sqrt(values[free])


def _shape(log_variance: float) -> float:
    """Return the shape a whose log σ² has this variance: ψ′(a) = log_variance."""

    def excess(log_shape: float) -> float:
        return float(polygamma(1, np.exp(log_shape))) - log_variance

    if log_variance <= 1.0 / MOST_SHAPE:
        return MOST_SHAPE
    ends = (np.log(1e-6), np.log(10.0 * MOST_SHAPE))
    return float(np.exp(scipy.optimize.root_scalar(excess, bracket=ends).root))


def normal_score(t: float, freedom: float) -> float:
    """Return the standard normal score with the probability of a Student one."""
    score = -float(ndtri(stdtr(freedom, -abs(t))))
    return copysign(min(score, FARTHEST), t)


@lru_cache(4)
def half_width(freedom: float) -> float:
    """Return half of the interval that holds 95 % of a Student law, in scales."""
    return float(stdtrit(freedom, 0.5 + LEVEL / 2.0))


def student_sd(scale, freedom: float):
    """Return the sd of a Student law; below two degrees of freedom it has none."""
    return scale * sqrt(freedom / (freedom - 2.0)) if freedom > 2.0 else inf
