"""Whether the data or the priors decide each parameter, and how well it was sampled."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import softmax

from hdcal.data.priors import Prior
from hdcal.inference.distributions import moments
from hdcal.inference.mixing import Mixing, mixing

# Share of the prior variance that the data must remove to decide a parameter; the
# second value where power-scaling finds the likelihood weak.
MIN_CONTRACTION, CLEAR_CONTRACTION = 0.75, 0.95
# Power-scaling sensitivity from which a prior or a likelihood matters.
SENSITIVE = 0.05
# Change of the power, up and down.
_POWER = 0.01

Driver = Literal["data", "prior"]
# The smallest number that has a logarithm.
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Diagnosis(Mixing):
    """Convergence of a parameter, and what decides it.

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
    to_prior = power_sensitivity(draws, log_prior)
    to_data = power_sensitivity(draws, log_likelihood)
    found = {}
    for name, mixed in mixing(draws).items():
        contraction = _contraction(draws[name], priors[name], name)
        weak = to_data[name] < SENSITIVE < to_prior[name]
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        found[name] = Diagnosis(
            rhat=mixed.rhat,
            ess_bulk=mixed.ess_bulk,
            ess_tail=mixed.ess_tail,
            contraction=contraction,
            prior_sensitivity=to_prior[name],
            likelihood_sensitivity=to_data[name],
            driven_by="data" if contraction >= enough else "prior",
        )
    return found


def _contraction(draws: np.ndarray, prior: Prior, name: str) -> float:
    """Return the share of the prior's variance that the data removed.

    A lognormal prior is compared in logarithms, in which its width is the same
    everywhere.
    """
    if prior.family == "lognormal":
        logarithm, sd = np.log(np.maximum(draws, _TINY)), float(prior.numbers[1])
        return float(1.0 - logarithm.var() / sd**2)
    return float(1.0 - draws.var() / moments(prior, name)[1] ** 2)


def power_sensitivity(
    draws: Mapping[str, np.ndarray], log_part: np.ndarray
) -> dict[str, float]:
    """Return how much each parameter changes with the power of a part of its density.

    The weights are not Pareto-smoothed: so near to one they have no tail.

    Args:
        draws: of each parameter, (chain, draw).
        log_part: log density of prior or likelihood of each draw.
    """
    from arviz_stats.base.array import array_stats

    about = {
        "lower_w": softmax(-_POWER * log_part),
        "upper_w": softmax(_POWER * log_part),
        "lower_alpha": 1.0 - _POWER,
        "upper_alpha": 1.0 + _POWER,
    }
    # The distance is 0/0 where all draws are equal.
    with np.errstate(all="ignore"):
        return {
            name: np.asarray(array_stats.power_scale_sense(values, **about)).item()
            for name, values in draws.items()
        }
