"""Content and confidence of bounds: what can be asked."""

from collections.abc import Mapping

from hdcal.data.plausible import implausible
from hdcal.errors import Finding

# Draws that must lie beyond a bound to locate it.
_BEYOND = 10
# A rarer case than one in a million rests on the normal law of the scatter alone:
# no test of this size has readings so far out.
RAREST = 1e-6


def share_findings(
    shares: Mapping[str, float], draws: int, more: str = ""
) -> list[Finding]:
    """Return findings for values that are no probabilities or cannot be resolved.

    Of a `confidence` so many draws must lie beyond; `more` follows what can be asked.
    """
    findings = [f for name, value in shares.items() for f in implausible(name, value)]
    if findings:
        return findings
    most = 1.0 - _BEYOND / draws
    for name, share in shares.items():
        if name == "confidence" and share > most:
            words = f"{draws} draws cannot resolve a confidence of {share:g}"
            findings.append(Finding(name, words, f"Ask for {most:.4g} or less{more}"))
        elif name != "confidence" and share > 1.0 - RAREST:
            words = f"{share:.12g} is beyond what a model of the scatter can promise"
            findings.append(Finding(name, words, f"Ask for {1.0 - RAREST:g} or less"))
    return findings
