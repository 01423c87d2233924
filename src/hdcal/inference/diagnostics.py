"""How well chains mixed, and whether data or priors drive each parameter."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr

from hdcal.data.priors import Prior
from hdcal.inference.distributions import moments

# Part of the prior variance that must be gone before the data, not the prior, drive;
# from the second value on also where power-scaling calls the likelihood weak.
MIN_CONTRACTION, CLEAR_CONTRACTION = 0.75, 0.95
# Power-scaling sensitivity from which a prior or a likelihood matters.
SENSITIVE = 0.05

# What chains that have mixed show at most, and at least.
MAX_RHAT, ESS_PER_CHAIN = 1.01, 100

Driver = Literal["data", "prior"]
# The smallest number that has a logarithm.
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Mixing:
    """How well the chains mixed in one quantity.

    Attributes:
        rhat: rank-normalised split R-hat.
        ess_bulk: effective draws for the centre.
        ess_tail: effective draws for the interval's ends.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float


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
    from arviz_base import from_dict

    tree = from_dict(
        {
            "posterior": dict(draws),
            "log_prior": {"prior": log_prior},
            "log_likelihood": {"force": log_likelihood},
        }
    )
    # On draws that stand still the statistics warn on their way to NaN; a NaN fails
    # its check, so nothing is hidden by keeping the terminal quiet.
    mixed = mixing(draws)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        to_prior = _sensitivity(tree, "prior")
        to_data = _sensitivity(tree, "likelihood")
    found = {}
    for name, values in draws.items():
        contraction = _contraction(values, priors[name])
        weak = to_data[name] < SENSITIVE < to_prior[name]
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        found[name] = Diagnosis(
            **vars(mixed[name]),
            contraction=contraction,
            prior_sensitivity=to_prior[name],
            likelihood_sensitivity=to_data[name],
            driven_by="data" if contraction >= enough else "prior",
        )
    return found


def _contraction(draws: np.ndarray, prior: Prior) -> float:
    """Return which share of the prior's variance the data removed.

    What a lognormal prior lets be large may scatter widely too; in logarithms its width
    is everywhere the same.
    """
    if prior.family == "lognormal":
        logarithm, sd = np.log(np.maximum(draws, _TINY)), float(prior.numbers[1])
        return float(1.0 - logarithm.var() / sd**2)
    return float(1.0 - draws.var() / moments(prior)[1] ** 2)


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return how well the chains mixed in each quantity, (chain, draw) each."""
    # Late: a finished result is read without them. They are put there at import time,
    # out of pyright's sight.
    from arviz_base import from_dict
    from arviz_stats import ess, rhat  # pyright: ignore[reportPrivateImportUsage]

    tree = from_dict({"posterior": dict(draws)})
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        split, bulk = _by_name(rhat(tree)), _by_name(ess(tree))
        tail = _by_name(ess(tree, method="tail"))
    return {name: Mixing(split[name], bulk[name], tail[name]) for name in draws}


def have_mixed(draws: Mapping[str, np.ndarray]) -> bool:
    """Tell whether chains mixed in every quantity, (chain, draw) each."""
    # A NaN, of draws that stand still, is neither.
    return all(
        one.rhat <= MAX_RHAT
        and min(one.ess_bulk, one.ess_tail) >= ESS_PER_CHAIN * len(draws[name])
        for name, one in mixing(draws).items()
    )


def _sensitivity(tree: xr.DataTree, group: str) -> dict[str, float]:
    from arviz_stats import psense  # pyright: ignore[reportPrivateImportUsage]

    try:
        return _by_name(psense(tree, group=group))
    except ValueError:  # draws that are all alike have no tail to smooth
        return dict.fromkeys(map(str, tree["posterior"].data_vars), np.nan)


def _by_name(result) -> dict[str, float]:
    dataset = result["posterior"].to_dataset() if "posterior" in result else result
    return {str(name): float(value) for name, value in dataset.data_vars.items()}
