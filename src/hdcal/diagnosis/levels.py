"""How much of a cause is said: the effect, its group, or only what is seen.

Probabilities compare hypotheses with each other. A level asks for more than that, and
what fails one is said on the next: nothing here moves a probability.
"""

from collections.abc import Container, Mapping

from hdcal.diagnosis.adequacy import leaves_most
from hdcal.diagnosis.detection import Detection
from hdcal.diagnosis.groups import LeadingGroup, identified
from hdcal.diagnosis.model_posterior import CARRIES, NAMED, SURE
from hdcal.diagnosis.verdict import VerdictWord
from hdcal.evidence.case_evidence import NONE, UNKNOWN, CaseEvidence
from hdcal.evidence.remainder_evidence import closed_by
from hdcal.physics.effect import Effect


def verdict_word(
    evidence: CaseEvidence,
    found: Detection,
    library: Mapping[str, type[Effect]],
    best: str,
    group: LeadingGroup | None,
    *,
    rival: bool,
    doubt: bool,
) -> VerdictWord:
    """Return the verdict in one word: as much as the data carry.

    Args:
        evidence: of the case.
        found: whether there is a gap, and the posterior over hypotheses.
        library: effects by name.
        best: the effect that leads.
        group: the most probable one.
        rival: there is one that this loading can never tell from the likeliest effect.
        doubt: the likeliest hypothesis leaves more than noise.
    """
    posterior = found.posterior
    if not found.detected or posterior.probabilities[NONE] >= 0.5:
        return "none"
    if posterior.top == UNKNOWN:
        return "unknown"
    inclusion = posterior.inclusion
    sure, likely = (
        {name for name, chance in inclusion.items() if chance >= least}
        for least in (SURE, NAMED)
    )

    def carry(names: Container[str]) -> bool:
        return closed_by(evidence, posterior.top.split("+"), names) >= CARRIES

    minor = leaves_most(evidence, posterior.top, best)
    alone = identified(posterior, library, best) >= SURE
    # A rival that this loading can never exclude is not excluded by a name.
    if alone and not rival and not doubt and not minor and carry(sure):
        return "named"
    if group is None or group.probability < NAMED or minor:
        return "ambiguous"
    # Noise that leaves more than noise is none.
    hollow = doubt and (not likely or best in evidence.on_noise)
    return "group" if not hollow and carry({*group.members, *likely}) else "ambiguous"
