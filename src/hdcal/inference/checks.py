"""Whether a posterior may be used, and what its reader must know.

A failed check fails the result; a warning or a note must be read.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.diagnostics import ESS_PER_CHAIN, MAX_RHAT, Mixing
from hdcal.inference.distributions import frozen
from hdcal.inference.force_model.serial_correlation import CORRELATION

if TYPE_CHECKING:
    from hdcal.inference.sample import Draws

INDEPENDENT = "neighbouring readings err independently"
PLAUSIBLE = "prior and data agree"
NOISY = "the noise is what such rigs have"
MIN_BFMI = 0.3
# Largest rounding step, in noise sds, for Sheppard's correction: error 4e-4 relative.
COARSEST_STEP = 1.5
# Two-sided tail probability of three standard deviations.
CONFLICT_TAIL = 0.0027
# Size and length of the discrepancy say nothing of units and sizes.
_DISCREPANCY = {"gap_sd", "gap_length"}
# Parameters in sentences, where their name is not that of the field.
_WORDS = {"sigma": "noise sd", CORRELATION: "correlation of neighbouring readings"}
# Parameters that are ordinarily zero: that is no bound that cuts an answer off.
_ORDINARY_AT_ZERO = frozenset({"run_offset_sd", "specimen_sd", "gap_sd", CORRELATION})
# Correlation that is reported where it is larger with 95 % probability [-].
_REPORTED_CORRELATION = 0.1
# A correlation from which intervals are too narrow where readings determine a mean no
# better than so many independent ones (tests/inference/test_correlation_prior.py).
_STRONG_CORRELATION, _FEW_EFFECTIVE = 0.5, 26.0
# The smallest share of its prior's upper end that is reported as the end itself: both
# have the same two digits.
_AT_BOUND = 0.99


@dataclass(frozen=True)
class Check:
    """The property that is checked, its outcome, and a sentence about it."""

    name: str
    outcome: Literal["passed", "note", "warning", "failed"]
    words: str


def _check(name: str, passed: bool, words: str) -> Check:
    return Check(name, "passed" if passed else "failed", words)


def sampling_checks(draws: "Draws", mixed: Mapping[str, Mixing]) -> tuple[Check, ...]:
    """Return the checks on NUTS."""
    from arviz_stats.base.array import array_stats

    # NaN, which no check passes, where the energy does not change.
    with np.errstate(all="ignore"):
        energy = np.asarray(array_stats.bfmi(draws.statistics["energy"]))
    diverging = draws.statistics["diverging"]
    divergent = int(diverging.sum())
    return (
        *mixing_checks(mixed, draws.shape[0]),
        _check(
            "energy is explored (BFMI)",
            bool(np.all(energy >= MIN_BFMI)),
            f"the smallest BFMI is {energy.min():.2f}, needed {MIN_BFMI}",
        ),
        _check(
            "no divergent trajectories",
            divergent == 0,
            f"{divergent} of {diverging.size} draws diverged, allowed 0",
        ),
    )


def mixing_checks(mixed: Mapping[str, Mixing], chains: int) -> tuple[Check, ...]:
    """Return the checks on the convergence of each quantity, for any sampler."""
    # Constant or infinite draws give NaN, which counts as the worst.
    rhat = {n: np.nan_to_num(m.rhat, nan=np.inf) for n, m in mixed.items()}
    size = {n: min(np.nan_to_num([m.ess_bulk, m.ess_tail])) for n, m in mixed.items()}
    worst, least = max(rhat, key=rhat.__getitem__), min(size, key=size.__getitem__)
    need = ESS_PER_CHAIN * chains
    return (
        _check(
            "chains agree (R-hat)",
            rhat[worst] <= MAX_RHAT,
            f"the largest R-hat is {rhat[worst]:.4f} ({worst}), allowed {MAX_RHAT}",
        ),
        _check(
            "enough effective draws (bulk and tail ESS)",
            size[least] >= need,
            f"the smallest effective sample size is {size[least]:.0f} ({least}), "
            f"needed {need}",
        ),
    )


def correlation_check(
    draws: Mapping[str, np.ndarray],
    rows: int,
    priors: Mapping[str, Prior],
    reason: str = "",
) -> Check:
    """Report the correlation of neighbouring readings, or the reason for none."""
    if CORRELATION not in draws:
        words = f"a correlation of neighbours is not inferred for these data: {reason}"
        return Check(INDEPENDENT, "note", words)
    least, low, middle, high = np.quantile(
        draws[CORRELATION], [0.05, 0.025, 0.5, 0.975]
    )
    if least < _REPORTED_CORRELATION:
        return Check(INDEPENDENT, "passed", "the readings show no correlation")
    words = f"the errors of neighbouring readings have a correlation of {middle:.2f}"
    prior = priors[CORRELATION]
    at_bound = prior.family == "uniform" and low > _AT_BOUND * float(prior.numbers[1])
    words += (
        ", the largest possible" if at_bound else f" ({low:.2f} to {high:.2f}, 95 %)"
    )
    # 1ᵀ R⁻¹ 1 with R of elements ρ^|i − j|: the variance of a mean.
    effective = (rows - (rows - 2) * middle) / (1.0 + middle)
    if middle < _STRONG_CORRELATION or effective > _FEW_EFFECTIVE:
        return Check(INDEPENDENT, "note", f"{words}, and every interval allows for it")
    words += (
        ". Every interval allows for it, but these readings are equivalent to some "
        f"{effective:.0f} independent ones: 95 % intervals can contain the truth in "
        "85 % of cases only. "
    )
    slow = "Errors that last so long are rather a curve, a loop or a drift: diagnose"
    return Check(
        INDEPENDENT, "warning", words + (slow if at_bound else "Read longer or repeat")
    )


def rounding_check(step: float, rounded: bool, sigma: np.ndarray) -> Check:
    """Fail a result whose noise sd [N] is too small for Sheppard's correction.

    `rounded` tells whether the exact likelihood of the rounding step [N] was used.
    """
    limit = COARSEST_STEP * float(np.median(sigma))
    how = f"by Sheppard's correction; that holds up to {limit:.3g} {{N}}"
    words = f"step {step:g} {{N}}, {'exact' if rounded else how}"
    return _check("rounding is treated rightly", rounded or step <= limit, words)


def conflict_check(
    draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]
) -> Check:
    """Warn of posteriors that lie far out in the tails of their priors."""
    far, above = {}, {}
    for parameter in (name for name in draws if name not in _DISCREPANCY):
        stated, values = priors[parameter], draws[parameter]
        prior, median = frozen(stated, parameter), float(np.median(values))
        # A density that is highest at zero, as of an effect, expects a zero.
        peaks_at_zero = stated.family == "half_normal" or (
            stated.family == "beta" and float(stated.numbers[0]) <= 1.0
        )
        below = np.inf if peaks_at_zero else prior.cdf(median)
        if 2.0 * min(below, prior.sf(median)) < CONFLICT_TAIL:
            low, high = prior.interval(1.0 - CONFLICT_TAIL)
            far[parameter] = f"{median:.3g}, expected {low:.3g} to {high:.3g}"
            above[parameter] = median > prior.median()
    if not far:
        return Check(PLAUSIBLE, "passed", "every median lies within its prior's 99.7 %")
    # A wrong unit would show in the stiffness too.
    if {*far} <= {"sigma", CORRELATION} and all(above.values()):
        name = NOISY
        remedy = "A loop, a bend or a drift that the model lacks counts as noise here"
    elif all("." in parameter for parameter in far):
        name = "prior and effects agree"
        remedy = "Where the rig explains it, state a prior for it"
    else:
        name = PLAUSIBLE
        remedy = "Check units, reading (radial or diametral) and sizes of the gear"
    medians = listed([f"{_WORDS.get(n, n)} = {words}" for n, words in far.items()])
    words = f"beyond the 99.7 % range of the prior: {medians}. {remedy}"
    return Check(name, "warning", words)


def bound_check(draws: Mapping[str, np.ndarray], priors: Mapping[str, Prior]) -> Check:
    """Warn of posteriors that are pressed against an end of their prior."""
    name, piled = "no parameter at a bound", []
    for parameter in (n for n in draws if n not in _ORDINARY_AT_ZERO):
        low, high = frozen(priors[parameter], parameter).support()
        flat = draws[parameter].reshape(-1)
        for end, distance in ((low, flat - low), (high, high - flat)):
            # A density that does not fall towards the end leaves a tenth of its
            # 95 % reach a share of at least a tenth; an inner one leaves none.
            reach = np.quantile(distance, 0.95) if np.isfinite(end) else 0.0
            if reach > 0.0 and np.mean(distance < 0.1 * reach) > 0.08:
                piled.append(f"{parameter} at {end:g}")
    if not piled:
        return Check(name, "passed", "every posterior lies inside its prior's range")
    words = "an effect at zero is not needed by these data, any other bound cuts the "
    return Check(name, "warning", f"{listed(piled)}: {words}answer off")


def listed(names: list[str]) -> str:
    """Return names as a list in words."""
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
