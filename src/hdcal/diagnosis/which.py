"""Which effect causes the gap: posterior over hypotheses, and how firm it is."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import starmap

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.adequacy import leaves_more_than_noise
from hdcal.diagnosis.amplitude import amplitude_of
from hdcal.diagnosis.detection import Detection
from hdcal.diagnosis.groups import (
    LeadingGroup,
    group_probabilities,
    leading_group,
    ranked_effects,
)
from hdcal.diagnosis.levels import verdict_word
from hdcal.diagnosis.lookalikes import inseparable, untestable_lookalikes
from hdcal.diagnosis.model_posterior import (
    CARRIES,
    SURE,
    ModelPosterior,
    posterior_of,
)
from hdcal.diagnosis.naming import naming
from hdcal.diagnosis.verdict import Certificate, NotTestable, Remainder, Which
from hdcal.evidence.case_evidence import (
    NONE,
    CaseEvidence,
    with_remainder,
)
from hdcal.evidence.resampled_evidence import resampled_evidence
from hdcal.evidence.single_evidence import rescaled_change
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.report.intervals import credible_interval

# Probability from which on what acts beside an effect is told, where neither is named.
_LIKELY = 0.5


def identify_cause(
    evidence: CaseEvidence,
    found: Detection,
    case: Case,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Which:
    """Return the verdict on the cause."""
    posterior, alike = found.posterior, inseparable(evidence)
    group = leading_group(posterior, library, alike, evidence.on_noise)
    ranked = ranked_effects(posterior, evidence.on_noise)
    doubt = found.detected and leaves_more_than_noise(
        evidence, posterior.top, case, library, found.correlation, rng.spawn(1)[0]
    )
    best = ranked[0] if ranked else ""
    unseen = untestable_lookalikes(evidence, best, library)
    others = [n for n in ranked[1:] if posterior.inclusion[n] >= SURE][:1]
    rival = bool(unseen) or any({best, *others} & {*pair} for pair in alike)
    word = verdict_word(evidence, found, library, best, group, rival=rival, doubt=doubt)
    mistaken = word == "named" and not all(map(naming().may_be_named, [best, *others]))
    word = "group" if mistaken else word
    suspected = word in ("named", "group", "ambiguous") and bool(ranked)
    leader = _leader(word, ranked, group)
    if leader != best:
        unseen = untestable_lookalikes(evidence, leader, library)
    if word != "named":
        others = _beside(posterior, leader, ranked)
    effect = leader if suspected else None
    counted = naming().called.get(effect or "")
    return Which(
        verdict=word,
        effect=effect,
        second_effect=others[0] if suspected and others else None,
        set=posterior.smallest_set if word != "none" else (NONE,),
        probabilities=posterior.probabilities,
        inclusion=posterior.inclusion,
        log_evidence=posterior.log_evidence,
        amplitude=amplitude_of(evidence, effect, library, rng) if effect else None,
        not_testable=tuple(starmap(NotTestable, evidence.not_testable.items())),
        not_excited=evidence.not_excited,
        inseparable=alike,
        group=group.name if group and suspected else None,
        group_members=group.members if group and suspected else (),
        group_probability=group.probability if group and suspected else None,
        groups=group_probabilities(posterior, library),
        remainder=_remainder(evidence, posterior, effect),
        doubted=doubt,
        lookalikes=unseen if suspected else (),
        lookalike_cases=counted.said if counted else 0,
        lookalike_rate=counted.rate if counted else None,
        describes_best=mistaken and not others and leader == best,
        certificate=_certificate(word, library),
        sensitivity=sensitivity(evidence, effect) if effect else {},
        stability=_stability(evidence, effect, rng) if effect else None,
    )


def _leader(word: str, ranked: Sequence[str], group: LeadingGroup | None) -> str:
    """Return the effect that leads: of the group, where that is what is said."""
    if word == "group" and group is not None:
        return next(name for name in ranked if name in group.members)
    return ranked[0] if ranked else ""


def _beside(posterior: ModelPosterior, leader: str, ranked: Sequence[str]) -> list[str]:
    """Return what acts beside an effect: surely, or in the likeliest pair."""
    rest = [name for name in ranked if name != leader]
    sure = [name for name in rest if posterior.inclusion[name] >= SURE]
    pair = posterior.top.split("+")
    if sure or leader not in pair or posterior.probabilities[posterior.top] < _LIKELY:
        return sure
    return [name for name in rest if name in pair]


def _certificate(word: str, library: Mapping) -> Certificate | None:
    """Return what was counted of such answers, by the library that was tested."""
    tally = {"named": naming().names, "group": naming().groups}.get(word)
    if tally is None or library.keys() != EFFECTS.keys():
        return None
    return Certificate(tally.said, tally.wrong, tally.at_most)


def _remainder(
    evidence: CaseEvidence, posterior: ModelPosterior, effect: str | None
) -> Remainder | None:
    """Return what lies beside the leading effect; None without one."""
    closed = evidence.closed.get(effect or "", np.zeros(0))
    closed = closed[closed >= CARRIES]
    if effect is None or not len(closed):
        return None
    chance = posterior.probabilities[with_remainder(effect)]
    share = credible_interval(1.0 - closed)
    return Remainder(chance / max(posterior.inclusion[effect], chance, 1e-300), share)


def sensitivity(evidence: CaseEvidence, effect: str) -> dict[str, float]:
    """Return the top effect's inclusion with amplitude priors ⅓ and 3 times as wide.

    Evidences of effects in pieces are computed anew; pairs move with their members.
    """
    result = {}
    for word, factor in (("narrower_x1/3", 1.0 / 3.0), ("wider_x3", 3.0)):
        moved = rescaled_change(
            evidence.single, evidence.piecewise, evidence.prepared.priors, factor
        )
        table = {
            name: value + sum(moved.get(part, 0.0) for part in name.split("+"))
            for name, value in evidence.table.items()
        }
        moved_posterior = posterior_of(replace(evidence, table=table))
        result[word] = float(moved_posterior.inclusion[effect])
    return result


def _stability(evidence: CaseEvidence, effect: str, rng) -> float | None:
    """Return the share of block-bootstrap samples in which the same effect wins."""
    if effect not in evidence.single.names:
        return None
    names = [NONE, *evidence.single.names]
    best = np.argmax(resampled_evidence(evidence, rng), axis=1)
    return float(np.mean([names[i] == effect for i in best]))
