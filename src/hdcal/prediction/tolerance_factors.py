"""Classical tolerance limits: what a normal sample, or any sample, can promise.

A bound with content p and confidence γ leaves at most the share 1 − p of a population
beyond it, in the share γ of all samples. These are the references of the Bayesian
bounds of `margin`, which agree with them where both exist.
"""

from collections.abc import Mapping

import numpy as np
from scipy import special

from hdcal.data.plausible import implausible
from hdcal.errors import Finding, InputError

# Content and confidence of the bounds that aviation names; of a population only.
BASES = {"A-basis": (0.99, 0.95), "B-basis": (0.90, 0.95)}
# Draws that must lie beyond a bound: fewer do not say where it is.
_BEYOND = 10
# The normal law is no guide to shares rarer than this.
_RAREST = 1e-9


def check_shares(**shares: float) -> list[Finding]:
    """Return a finding for every share that does not lie between 0 and 1."""
    return [f for name, value in shares.items() for f in implausible(name, value)]


def check_rarity(
    shares: Mapping[str, float], draws: int, more: str = ""
) -> list[Finding]:
    """Return findings for what so many draws, or any normal law, cannot tell.

    Args:
        shares: by name; the confidence is one of draws.
        draws: of what is not known.
        more: how there would be more of them, after what can be asked.
    """
    findings = []
    sure, most = shares["confidence"], 1.0 - _BEYOND / draws
    if most < sure < 1.0:
        words = f"{draws} draws cannot tell a confidence of {sure:g}"
        remedy = f"Ask for {most:.4g} or less{more}"
        findings.append(Finding("confidence", words, remedy))
    for name in shares.keys() - {"confidence"}:
        if 1.0 - _RAREST < shares[name] < 1.0:
            words = f"{shares[name]:.12g} is beyond what any model of noise can promise"
            remedy = "Ask for 0.999999999 or less"
            findings.append(Finding(name, words, remedy))
    return findings


def k_factor(size: int, content: float = 0.99, confidence: float = 0.95) -> float:
    """Return the one-sided normal tolerance factor k: the bound is mean ± k·s.

    k = t⁻¹(γ; n − 1, z_p √n) / √n, with the quantile of the noncentral t.

    Args:
        size: of the sample, two or more.
        content: p, share of the population within the bound.
        confidence: γ.

    Raises:
        InputError: a share is not between 0 and 1, or the sample is too small.

    Source:
        Owen (1968), Technometrics 10; CMH-17, vol. 1, ch. 8 (A- and B-basis).
    """
    findings = check_shares(content=content, confidence=confidence)
    findings += implausible("size", size, "sample")
    if findings:
        raise InputError(findings)
    root = np.sqrt(size)
    shift = special.ndtri(content) * root
    return float(special.nctdtrit(size - 1, shift, confidence) / root)


def wilks_size(
    content: float = 0.99, confidence: float = 0.95, *, sides: int = 1
) -> int:
    """Return how large a sample is whose extremes are a bound, whatever its law.

    One side: the smallest n with 1 − pⁿ ≥ γ. Two sides, lowest and highest together:
    1 − pⁿ − n (1 − p) pⁿ⁻¹ ≥ γ.

    Args:
        content: p, share of the population within the bound.
        confidence: γ.
        sides: 1 or 2.

    Raises:
        InputError: a share is not between 0 and 1, or the sides are neither 1 nor 2.

    Source:
        Wilks (1941), Annals of Mathematical Statistics 12.
    """
    findings = check_shares(content=content, confidence=confidence)
    if sides not in (1, 2):
        findings.append(Finding("sides", f"{sides} is neither 1 nor 2", "Give 1 or 2"))
    if findings:
        raise InputError(findings)

    def short(size: int) -> bool:
        # Beyond the bound lie at most `sides − 1` of the sample.
        chance = float(special.bdtr(sides - 1, size, 1.0 - content))
        return chance > 1.0 - confidence

    low, high = 0, 1
    while short(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if short(middle) else (low, middle)
    return high
