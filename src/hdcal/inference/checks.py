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
# Largest rounding step, in noise sds, for Sheppard's correction: error 4e-4 relative.
COARSEST_STEP = 1.5
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
        contraction: 1 − var(posterior)/var(prior).
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
        contraction = 1.0 - values.var() / frozen(priors[name]).var()
        weak = to_data[name] < SENSITIVE < to_prior[name]
        enough = CLEAR_CONTRACTION if weak else MIN_CONTRACTION
        found[name] = Diagnosis(
            **vars(mixed[name]),
            contraction=float(contraction),
            prior_sensitivity=to_prior[name],
            likelihood_sensitivity=to_data[name],
            driven_by="data" if contraction >= enough else "prior",
        )
    return found


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return how well the chains mixed in each quantity, (chain, draw) each."""
    tree = from_dict({"posterior": dict(draws)})
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        split, bulk = _by_name(rhat(tree)), _by_name(ess(tree))
        tail = _by_name(ess(tree, method="tail"))
    return {name: Mixing(split[name], bulk[name], tail[name]) for name in draws}


def _sensitivity(tree: xr.DataTree, group: str) -> dict[str, float]:
    try:
        return _by_name(psense(tree, group=group))
    except ValueError:  # draws that are all alike have no tail to smooth
        return dict.fromkeys(map(str, tree["posterior"].data_vars), np.nan)


def _by_name(result) -> dict[str, float]:
    dataset = result["posterior"].to_dataset() if "posterior" in result else result
    return {str(name): float(value) for name, value in dataset.data_vars.items()}


def sampling_checks(
    stats: xr.Dataset, mixed: Mapping[str, Mixing]
) -> tuple[Check, ...]:
    """Return the checks on the sampler: any of them failed fails the result.

    Args:
        stats: energy, diverging, n_steps; dimensions chain and draw.
        mixed: by quantity.
    """
    chains = stats.sizes["chain"]
    worst = max(mixed, key=lambda name: _bad(mixed[name].rhat))
    least = min(
        mixed,
        key=lambda name: _least(mixed[name]),
    )
    top, need = mixed[worst].rhat, ESS_PER_CHAIN * chains
    low = _least(mixed[least])
    with np.errstate(all="ignore"):
        energy = np.asarray(bfmi(stats["energy"].to_numpy(), chain_axis=0, draw_axis=1))
    divergent = int(stats["diverging"].sum())
    saturated = float((stats["n_steps"] >= 2**MAX_TREE_DEPTH - 1).mean())
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


def _least(mixed: Mixing) -> float:
    sizes = (mixed.ess_bulk, mixed.ess_tail)
    return 0.0 if np.isnan(sizes).any() else min(sizes)


def _check(name: str, passed: bool, words: str) -> Check:
    return Check(name, "passed" if passed else "failed", words)


def rounding_check(step: float, rounded: bool, sigma: np.ndarray) -> Check:
    """Fail a result whose noise is too small for Sheppard's correction.

    Args:
        step: rounding step [N].
        rounded: whether the exact rounding likelihood was used.
        sigma: draws of the noise sd [N].
    """
    limit = COARSEST_STEP * float(np.median(sigma))
    exact = "exact" if rounded else "by Sheppard's correction"
    return _check(
        "rounding is treated rightly",
        rounded or step <= limit,
        f"step {step:g} N, {exact}"
        + ("" if rounded else f"; that holds up to {limit:.3g} N"),
    )


def conflict_check(
    draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]
) -> Check:
    """Say which posteriors lie where their prior thought nothing would be."""
    name = "prior and data agree"
    far = []
    for parameter, values in draws.items():
        prior, median = frozen(priors[parameter]), float(np.median(values))
        # A density that is highest at zero, as of an effect, expects a zero.
        below = np.inf if _peaks_at_zero(priors[parameter]) else prior.cdf(median)
        if 2.0 * min(below, prior.sf(median)) < CONFLICT_TAIL:
            low, high = prior.interval(1.0 - CONFLICT_TAIL)
            far.append(f"{parameter} = {median:.3g}, expected {low:.3g} to {high:.3g}")
    if not far:
        return Check(name, "passed", "every median lies within its prior's 99.7 %")
    words = f"far outside what was expected before the data: {_list(far)}"
    remedy = "a wrong unit, reading (radial or diametral) or size of the gear?"
    return Check(name, "warning", f"{words}. {remedy}")


def _peaks_at_zero(prior: Prior) -> bool:
    if prior.family == "beta":
        return float(prior.numbers[0]) <= 1.0
    return prior.family == "half_normal"


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
