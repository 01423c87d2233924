"""Convergence of chains and of importance weights, as arviz-stats computes it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

# Limits of chains that have mixed: the largest R-hat, the smallest ESS of each chain.
MAX_RHAT, ESS_PER_CHAIN = 1.01, 100
# Probability of the default interval of ArviZ, whose ends the tail ESS is for.
_TAIL = 0.89


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


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return the convergence of each quantity, (chain, draw) each."""
    return {name: _mixing(np.asarray(values, float)) for name, values in draws.items()}


def _mixing(values: np.ndarray) -> Mixing:
    # Importing arviz-stats takes a second.
    from arviz_stats.base.array import array_stats

    with np.errstate(all="ignore"):
        found = (
            array_stats.rhat(values),
            array_stats.ess(values),
            array_stats.ess(values, method="tail", prob=_TAIL),
        )
    return Mixing(*(np.asarray(one).item() for one in found))


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
