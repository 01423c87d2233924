"""How well each parameter was sampled, and whether data or prior decide it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from scipy.special import softmax

from hdcal.data.priors import Prior
from hdcal.inference.distributions import moments

# Limits of chains that have mixed: the largest R-hat, the smallest ESS of each chain.
MAX_RHAT, ESS_PER_CHAIN = 1.01, 100
# Doublings of a trajectory.
MAX_TREE_DEPTH = 10
# Probability of ArviZ' default interval, for the ends of which the tail ESS is.
_TAIL = 0.89
# Share of the prior variance that the data must remove to decide a parameter; the
# second value where power-scaling finds the likelihood weak.
MIN_CONTRACTION, CLEAR_CONTRACTION = 0.75, 0.95
# Power-scaling sensitivity from which a prior or a likelihood matters, and the change
# of the power, up and down.
SENSITIVE, _POWER = 0.05, 0.01

Driver = Literal["data", "prior"]
_SMALLEST = np.finfo(float).tiny


@dataclass(frozen=True)
class Mixing:
    """Convergence of the chains in one quantity.

    Attributes:
        rhat: rank-normalised split R-hat; NaN where all draws are equal.
        ess_bulk: effective sample size of the centre.
        ess_tail: effective sample size of the ends of the interval.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float


@dataclass(frozen=True)
class Convergence(Mixing):
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


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return the convergence of each quantity, (chain, draw) each."""
    # Importing arviz-stats takes a second.
    from arviz_stats.base.array import array_stats

    found = {}
    with np.errstate(all="ignore"):
        for name, values in draws.items():
            values = np.asarray(values, float)
            numbers = (
                array_stats.rhat(values),
                array_stats.ess(values),
                array_stats.ess(values, method="tail", prob=_TAIL),
            )
            found[name] = Mixing(*(np.asarray(number).item() for number in numbers))
    return found


def have_mixed(draws: Mapping[str, np.ndarray]) -> bool:
    """Return whether the chains of every quantity have mixed, (chain, draw) each."""
    # Comparisons with NaN, the R-hat of equal draws, are false.
    return all(
        one.rhat <= MAX_RHAT
        and min(one.ess_bulk, one.ess_tail) >= ESS_PER_CHAIN * len(draws[name])
        for name, one in mixing(draws).items()
    )


def pareto_shape(weight: np.ndarray) -> float:
    """Return the Pareto k of importance weights; infinite if few are above zero.

    Args:
        weight: of independent draws, up to a factor, shape (n,).

    Raises:
        ValueError: the largest weights are equal.
    """
    from arviz_stats.base.array import array_stats

    # The tail that is fitted would hold weights of zero.
    if np.count_nonzero(weight) <= 3.0 * np.sqrt(len(weight)):
        return np.inf
    shape = array_stats.pareto_khat(weight[None], r_eff=1.0, tail="right")
    return np.asarray(shape).item()


def diagnose_parameters(
    draws: Mapping[str, np.ndarray],
    priors: Mapping[str, Prior],
    log_prior: np.ndarray,
    log_likelihood: np.ndarray,
) -> dict[str, Convergence]:
    """Return the convergence of each scalar parameter, and what decides it."""
    to_prior = power_sensitivity(draws, log_prior)
    to_data = power_sensitivity(draws, log_likelihood)
    diagnoses = {}
    for name, mixed in mixing(draws).items():
        contraction = _contraction(draws[name], priors[name], name)
        weak = to_data[name] < SENSITIVE < to_prior[name]
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        diagnoses[name] = Convergence(
            **asdict(mixed),
            contraction=contraction,
            prior_sensitivity=to_prior[name],
            likelihood_sensitivity=to_data[name],
            driven_by="data" if contraction >= enough else "prior",
        )
    return diagnoses


def _contraction(draws: np.ndarray, prior: Prior, name: str) -> float:
    """Return the share of the prior's variance that the data removed.

    A lognormal prior is compared in logarithms, in which its width is the same
    everywhere.
    """
    if prior.family == "lognormal":
        logarithm, sd = np.log(np.maximum(draws, _SMALLEST)), float(prior.numbers[1])
        return float(1.0 - logarithm.var() / sd**2)
    return float(1.0 - draws.var() / moments(prior, name)[1] ** 2)


def power_sensitivity(
    draws: Mapping[str, np.ndarray], log_part: np.ndarray
) -> dict[str, float]:
    """Return how much each parameter changes with the power of prior or likelihood.

    The weights are not Pareto-smoothed: so near to one they have no tail.
    """
    from arviz_stats.base.array import array_stats

    weights = {
        "lower_w": softmax(-_POWER * log_part),
        "upper_w": softmax(_POWER * log_part),
        "lower_alpha": 1.0 - _POWER,
        "upper_alpha": 1.0 + _POWER,
    }
    # The distance is 0/0 where all draws are equal.
    with np.errstate(all="ignore"):
        return {
            name: np.asarray(array_stats.power_scale_sense(values, **weights)).item()
            for name, values in draws.items()
        }
