"""Whether a posterior may be used, and what in it is data and what is prior.

A failed check fails the result. A warning or a note leaves it usable and says what
the reader must know.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr
from arviz_base import from_dict

# They are put there at import time, out of pyright's sight.
from arviz_stats import (
    bfmi,  # pyright: ignore[reportPrivateImportUsage]
    ess,  # pyright: ignore[reportPrivateImportUsage]
    psense,  # pyright: ignore[reportPrivateImportUsage]
    rhat,  # pyright: ignore[reportPrivateImportUsage]
)

from hdcal.inference.distributions import bounds, frozen
from hdcal.inference.sample import MAX_TREE_DEPTH
from hdcal.rig.priors import Prior

MAX_RHAT = 1.01
ESS_PER_CHAIN = 100
MIN_BFMI = 0.3
MAX_SATURATED = 0.01
# Two-sided tail probability of three standard deviations.
CONFLICT_TAIL = 0.0027
# Part of the prior variance that must be gone before the data, not the prior, drive;
# from the second value on also where power-scaling calls the likelihood weak.
MIN_CONTRACTION, CLEAR_CONTRACTION = 0.75, 0.95
# Power-scaling sensitivity from which a prior or a likelihood matters.
SENSITIVE = 0.05

# Scatter of nothing is an ordinary answer, not a bound that is in the way.
SCATTER = frozenset({"run_offset_sd", "specimen_sd", "gap_sd"})

Driver = Literal["data", "prior"]


@dataclass(frozen=True)
class Check:
    """One check and what it found.

    Attributes:
        name: what was checked.
        outcome: failed = do not use the result; warning and note = read this.
        words: one sentence for people.
    """

    name: str
    outcome: Literal["passed", "note", "warning", "failed"]
    words: str


@dataclass(frozen=True)
class Diagnosis:
    """Numbers of the checks for one parameter.

    Attributes:
        rhat: rank-normalised split R-hat.
        ess_bulk: effective draws for the centre.
        ess_tail: effective draws for the interval's ends.
        contraction: 1 − var(posterior)/var(prior).
        prior_sensitivity: change of the posterior when the priors are power-scaled.
        likelihood_sensitivity: likewise for the likelihood.
        driven_by: whether the data or the prior decide the parameter.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float
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
    tree = from_dict(
        {
            "posterior": dict(draws),
            "log_prior": {"prior": log_prior},
            "log_likelihood": {"force": log_likelihood},
        }
    )
    # On draws that stand still the statistics warn on their way to NaN; a NaN fails
    # its check, so nothing is hidden by keeping the terminal quiet.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        bulk, tail = _by_name(ess(tree)), _by_name(ess(tree, method="tail"))
        split = _by_name(rhat(tree))
        to_prior = _sensitivity(tree, "prior")
        to_data = _sensitivity(tree, "likelihood")
    found = {}
    for name, values in draws.items():
        contraction = 1.0 - values.var() / frozen(priors[name]).var()
        weak = to_data[name] < SENSITIVE < to_prior[name]
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        found[name] = Diagnosis(
            rhat=split[name],
            ess_bulk=bulk[name],
            ess_tail=tail[name],
            contraction=float(contraction),
            prior_sensitivity=to_prior[name],
            likelihood_sensitivity=to_data[name],
            driven_by="data" if contraction >= enough else "prior",
        )
    return found


def _sensitivity(tree: xr.DataTree, group: str) -> dict[str, float]:
    try:
        return _by_name(psense(tree, group=group))
    except ValueError:  # draws that are all alike have no tail to smooth
        return dict.fromkeys(map(str, tree["posterior"].data_vars), np.nan)


def _by_name(result) -> dict[str, float]:
    dataset = result["posterior"].to_dataset() if "posterior" in result else result
    return {str(name): float(value) for name, value in dataset.data_vars.items()}


def sampling_checks(
    stats: xr.Dataset, diagnoses: Mapping[str, Diagnosis]
) -> tuple[Check, ...]:
    """Return the checks on the sampler: any of them failed fails the result.

    Args:
        stats: energy, diverging, tree_depth; dimensions chain and draw.
        diagnoses: by parameter.
    """
    chains = stats.sizes["chain"]
    worst = max(diagnoses, key=lambda name: _bad(diagnoses[name].rhat))
    least = min(
        diagnoses,
        key=lambda name: _least(diagnoses[name]),
    )
    top, need = diagnoses[worst].rhat, ESS_PER_CHAIN * chains
    low = _least(diagnoses[least])
    with np.errstate(all="ignore"):
        energy = np.asarray(bfmi(stats["energy"].to_numpy(), chain_axis=0, draw_axis=1))
    divergent = int(stats["diverging"].sum())
    saturated = float((stats["tree_depth"] >= MAX_TREE_DEPTH).mean())
    return (
        _check(
            "chains agree (R-hat)",
            top <= MAX_RHAT,
            f"the largest R-hat is {top:.3f} ({worst}), allowed {MAX_RHAT}",
        ),
        _check(
            "enough effective draws (bulk and tail ESS)",
            low >= need,
            f"the smallest effective sample size is {low:.0f} ({least}), needed {need}",
        ),
        _check(
            "energy is explored (BFMI)",
            bool(np.all(energy >= MIN_BFMI)),
            f"the smallest BFMI is {energy.min():.2f}, needed {MIN_BFMI}",
        ),
        _check(
            "no divergent trajectories",
            divergent == 0,
            f"{divergent} of {stats['diverging'].size} draws diverged, allowed 0",
        ),
        _check(
            "trajectories end by themselves (tree depth)",
            saturated <= MAX_SATURATED,
            f"{saturated:.1%} of trajectories were cut off, allowed "
            f"{MAX_SATURATED:.0%}",
        ),
    )


def _bad(value: float) -> float:
    # Constant or infinite draws give NaN, which must count as the worst.
    return np.inf if np.isnan(value) else value


def _least(diagnosis: Diagnosis) -> float:
    sizes = (diagnosis.ess_bulk, diagnosis.ess_tail)
    return 0.0 if np.isnan(sizes).any() else min(sizes)


def _check(name: str, passed: bool, words: str) -> Check:
    return Check(name, "passed" if passed else "failed", words)


def conflict_check(
    draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]
) -> Check:
    """Say which posteriors lie where their prior thought nothing would be."""
    name = "prior and data agree"
    far = []
    for parameter, values in draws.items():
        prior, median = frozen(priors[parameter]), float(np.median(values))
        if 2.0 * min(prior.cdf(median), prior.sf(median)) < CONFLICT_TAIL:
            low, high = prior.interval(1.0 - CONFLICT_TAIL)
            far.append(f"{parameter} = {median:.3g}, expected {low:.3g} to {high:.3g}")
    if not far:
        return Check(name, "passed", "every median lies within its prior's 99.7 %")
    words = f"far outside what was expected before the data: {_list(far)}"
    remedy = "a wrong unit, reading (radial or diametral) or size of the gear?"
    return Check(name, "warning", f"{words}. {remedy}")


def bound_check(draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]) -> Check:
    """Say which posteriors are pressed against an end of their prior."""
    name = "no parameter at a bound"
    piled = []
    for parameter, values in draws.items():
        if parameter in SCATTER:
            continue
        low, high = bounds(priors[parameter])
        flat = values.reshape(-1)
        ends = ((low, flat - low), (high, high - flat))
        for end, distance in ends:
            # A density that does not fall towards the end leaves a tenth of its
            # 95 % reach a share of at least a tenth; an inner one leaves none.
            reach = np.quantile(distance, 0.95) if np.isfinite(end) else 0.0
            if reach > 0.0 and np.mean(distance < 0.1 * reach) > 0.08:
                piled.append(f"{parameter} at {end:g}")
    if not piled:
        return Check(name, "passed", "every posterior lies inside its prior's range")
    return Check(
        name,
        "warning",
        f"{_list(piled)}: an effect at zero is not needed by these data, any other "
        "bound cuts the answer off",
    )


def _list(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def identification_checks(dead: list[str], flat: list[str]) -> tuple[Check, ...]:
    """Report dead parameters and flat directions; the prior answers for both."""
    seen, apart = "every parameter is seen by the data", "parameters can be told apart"
    words = [
        f"{name}: these data say nothing, the prior is the answer" for name in dead
    ]
    checks = [Check(seen, "note", sentence) for sentence in words]
    checks += [Check(apart, "note", sentence) for sentence in flat]
    if not dead:
        checks.append(Check(seen, "passed", "each one moves the predicted readings"))
    if not flat:
        checks.append(Check(apart, "passed", "no direction is left to the priors"))
    return tuple(checks)
