"""Whether data or priors drive each parameter, beside how well its chains mixed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import softmax

from hdcal.data.priors import Prior
from hdcal.inference.distributions import moments
from hdcal.inference.mixing import Mixing, mixing

# Part of the prior variance that must be gone before the data, not the prior, drive;
# from the second value on also where power-scaling calls the likelihood weak.
MIN_CONTRACTION, CLEAR_CONTRACTION = 0.75, 0.95
# Power-scaling sensitivity from which a prior or a likelihood matters.
SENSITIVE = 0.05
# By so much a power is changed to see what it does.
_POWER = 0.01

Driver = Literal["data", "prior"]
# The smallest number that has a logarithm.
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Diagnosis(Mixing):
    """Mixing, and what drives a parameter.

    Attributes:
        contraction: 1 − var(posterior)/var(prior), of a lognormal prior in logarithms.
        prior_sensitivity: change of the posterior when the priors are power-scaled.
        likelihood_sensitivity: likewise for the likelihood.
        driven_by: whether the data or the prior decide the parameter.
    """

    contraction: float
    prior_sensitivity: float
    likelihood_sensitivity: float
    driven_by: Driver


def diagnose_parameters(
    draws: Mapping[str, np.ndarray],
    priors: Mapping[str, Prior],
    log_prior: np.ndarray,
    log_likelihood: np.ndarray,
) -> dict[str, Diagnosis]:
    """Return the sampling quality and the driver of each parameter.

    Args:
        draws: scalar parameters, each (chain, draw).
        priors: prior of each parameter.
        log_prior: of each draw.
        log_likelihood: of each draw, all data.
    """
    mixed = mixing(draws)
    # On draws that stand still the statistics are NaN, which fails its check.
    with np.errstate(all="ignore"):
        to_prior = dict(zip(draws, _sensitivity(draws, log_prior), strict=True))
        to_data = dict(zip(draws, _sensitivity(draws, log_likelihood), strict=True))
    found = {}
    for name, values in draws.items():
        contraction = _contraction(values, priors[name], name)
        weak = bool(to_data[name] < SENSITIVE < to_prior[name])
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        found[name] = Diagnosis(
            **vars(mixed[name]),
            contraction=contraction,
            prior_sensitivity=float(to_prior[name]),
            likelihood_sensitivity=float(to_data[name]),
            driven_by="data" if contraction >= enough else "prior",
        )
    return found


def _contraction(draws: np.ndarray, prior: Prior, name: str) -> float:
    """Return which share of the prior's variance the data removed.

    What a lognormal prior lets be large may scatter widely too; in logarithms its width
    is everywhere the same.
    """
    if prior.family == "lognormal":
        logarithm, sd = np.log(np.maximum(draws, _TINY)), float(prior.numbers[1])
        return float(1.0 - logarithm.var() / sd**2)
    return float(1.0 - draws.var() / moments(prior, name)[1] ** 2)


def _sensitivity(draws: Mapping[str, np.ndarray], log_part: np.ndarray) -> np.ndarray:
    """Return how much each parameter changes with the power of a part of its density.

    Source: Kallioinen, Paananen, Bürkner and Vehtari, Statistics and Computing 34, 57
    (2024). Weights so near to one have no tail that was worth smoothing.

    Args:
        draws: of each parameter, (chain, draw).
        log_part: log density of prior or likelihood of each draw.
    """
    flat = np.stack([values.ravel() for values in draws.values()])
    order = np.argsort(flat, axis=1)
    width = np.diff(np.take_along_axis(flat, order, axis=1))
    slopes = []
    for power in (1.0 - _POWER, 1.0 + _POWER):
        weight = softmax((power - 1.0) * log_part.ravel())[order]
        distance = np.maximum(
            _distance(width, weight), _distance(width[:, ::-1], weight[:, ::-1])
        )
        slopes.append(distance / abs(np.log2(power)))
    return np.mean(slopes, axis=0)


def _distance(width: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the cumulative Jensen-Shannon distance of weighted from equal draws.

    Args:
        width: between neighbours among the sorted draws, shape (k, d − 1).
        weight: of the sorted draws, sum 1, shape (k, d).
    """
    equal = np.arange(1, weight.shape[1]) / weight.shape[1]
    weighed = np.cumsum(weight, axis=1)[:, :-1]
    middle = np.log2(0.5 * (equal + weighed))
    areas = width @ equal, np.sum(width * weighed, axis=1)
    lean = 0.5 / np.log(2.0) * (areas[1] - areas[0])
    gains = (
        np.sum(width * equal * (np.log2(equal) - middle), axis=1) + lean,
        np.sum(width * weighed * (np.log2(weighed) - middle), axis=1) - lean,
    )
    return np.sqrt(sum(np.maximum(gain, 0.0) for gain in gains) / sum(areas))
