"""Content and confidence of bounds: named pairs, and limits of what can be asked."""

from collections.abc import Mapping

from hdcal.data.plausible import implausible
from hdcal.errors import Finding

# Content and confidence of the bounds named in aviation (CMH-17, vol. 1, ch. 8).
BASES = {"A-basis": (0.99, 0.95), "B-basis": (0.90, 0.95)}
# Least number of draws beyond a bound that locate it.
_BEYOND = 10
# A normal distribution does not describe tails rarer than this.
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
