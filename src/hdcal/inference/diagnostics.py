"""How well each quantity was sampled, and whether data or prior decide it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.distributions import moments

# Limits of chains that have mixed: the largest R-hat, the smallest ESS of each chain.
MAX_RHAT, ESS_PER_CHAIN = 1.01, 100
# Probability of ArviZ' default interval, for the ends of which the tail ESS is.
_TAIL = 0.89
# Share of the prior variance that the data must remove to decide a parameter.
MIN_CONTRACTION = 0.75

Driver = Literal["data", "prior"]
_SMALLEST = np.finfo(float).tiny


@dataclass(frozen=True)
class Mixing:
    """Convergence of the chains in one quantity; R-hat is NaN where draws are equal."""

    rhat: float
    ess_bulk: float
    ess_tail: float


@dataclass(frozen=True)
class Convergence(Mixing):
    """Convergence of a parameter, and what decides it."""

    # 1 − var(posterior)/var(prior), of a lognormal prior in logarithms.
    contraction: float
    driven_by: Driver


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return the convergence of each quantity, (chain, draw) each."""
    # Importing arviz-stats takes a second.
    from arviz_stats.base.array import array_stats

    def of(values: np.ndarray) -> Mixing:
        numbers = (
            array_stats.rhat(values),
            array_stats.ess(values),
            array_stats.ess(values, method="tail", prob=_TAIL),
        )
        return Mixing(*(np.asarray(number).item() for number in numbers))

    with np.errstate(all="ignore"):
        return {name: of(np.asarray(v, float)) for name, v in draws.items()}


def have_mixed(draws: Mapping[str, np.ndarray]) -> bool:
    """Return whether the chains of every quantity have mixed, (chain, draw) each."""
    # Comparisons with NaN, the R-hat of equal draws, are false.
    return all(
        mixed.rhat <= MAX_RHAT
        and min(mixed.ess_bulk, mixed.ess_tail) >= ESS_PER_CHAIN * len(draws[name])
        for name, mixed in mixing(draws).items()
    )


def pareto_shape(weight: np.ndarray) -> float:
    """Return the Pareto k of importance weights (n,); infinite if few are positive."""
    from arviz_stats.base.array import array_stats

    # The tail that is fitted would hold weights of zero.
    if np.count_nonzero(weight) <= 3.0 * np.sqrt(len(weight)):
        return np.inf
    shape = array_stats.pareto_khat(weight[None], r_eff=1.0, tail="right")
    return np.asarray(shape).item()


def diagnose_parameters(
    draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]
) -> dict[str, Convergence]:
    """Return the convergence of each scalar parameter, and what decides it."""
    diagnoses = {}
    for name, mixed in mixing(draws).items():
        share = _contraction(draws[name], priors[name], name)
        driver: Driver = "data" if share >= MIN_CONTRACTION else "prior"
        diagnoses[name] = Convergence(
            **asdict(mixed), contraction=share, driven_by=driver
        )
    return diagnoses


def _contraction(draws: np.ndarray, prior: Prior, name: str) -> float:
    """Return the share of the prior's variance that the data removed."""
    if prior.family == "lognormal":
        # In logarithms the width of the prior is the same everywhere.
        logarithm, sd = np.log(np.maximum(draws, _SMALLEST)), float(prior.numbers[1])
        return float(1.0 - logarithm.var() / sd**2)
    return float(1.0 - draws.var() / moments(prior, name)[1] ** 2)
