"""Which effect causes the gap: posterior over hypotheses, and how firm it is."""

from itertools import combinations, starmap

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.adequacy import leaves_more_than_noise
from hdcal.diagnosis.amplitude import amplitude_of
from hdcal.diagnosis.detection import Detection
from hdcal.diagnosis.groups import (
    group_probabilities,
    leading_group,
    ranked_effects,
)
from hdcal.diagnosis.levels import verdict_word
from hdcal.diagnosis.lookalikes import ALIKE, untestable_lookalikes
from hdcal.diagnosis.model_posterior import (
    CARRIES,
    NAMED,
    ModelPosterior,
    carried,
    model_posterior,
)
from hdcal.diagnosis.verdict import NotTestable, Remainder, Which
from hdcal.diagnosis.where import interval
from hdcal.evidence.case_evidence import (
    LEAST_SEEN,
    NONE,
    CaseEvidence,
    with_remainder,
)
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.resampled_evidence import resampled_evidence
from hdcal.evidence.single_evidence import rescaled_change
from hdcal.physics.effect import Effect


def identify_cause(
    evidence: CaseEvidence,
    found: Detection,
    case: Case,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Which:
    """Return the verdict on the cause."""
    posterior, alike = found.posterior, inseparable(evidence)
    noise = evidence.on_noise
    group = leading_group(posterior, library, alike, noise)
    ranked = ranked_effects(posterior, noise)
    doubt = found.detected and leaves_more_than_noise(
        evidence, posterior.top, case, library, found.correlation, rng.spawn(1)[0]
    )
    best = ranked[0] if ranked else ""
    unseen = untestable_lookalikes(evidence, best, library)
    others = [n for n in ranked[1:] if posterior.inclusion[n] >= NAMED]
    said = {best, *others[:1]}
    rival = bool(unseen) or any(said & {*pair} for pair in alike)
    word = verdict_word(evidence, found, library, best, group, rival=rival, doubt=doubt)
    suspected = word in ("named", "group", "ambiguous") and bool(ranked)
    effect = best if suspected else None
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
        sensitivity=sensitivity(evidence, effect) if effect else {},
        stability=_stability(evidence, effect, rng) if effect else None,
    )


def _remainder(
    evidence: CaseEvidence, posterior: ModelPosterior, effect: str | None
) -> Remainder | None:
    """Return what lies beside the leading effect; None without one."""
    closed = evidence.closed.get(effect or "", np.zeros(0))
    closed = closed[closed >= CARRIES]
    if effect is None or not len(closed):
        return None
    chance = posterior.probabilities[with_remainder(effect)]
    share = interval(1.0 - closed)
    return Remainder(chance / max(posterior.inclusion[effect], chance, 1e-300), share)


def inseparable(evidence: CaseEvidence) -> tuple[tuple[str, str], ...]:
    """Return pairs of effects that this loading can never tell apart.

    In the best case most of the smaller one is shared by the other, and what is not
    has less than `LEAST_SEEN` squared noise sds.
    """
    rows, noise = evidence.prepared.rows, evidence.prepared.noise_sd
    left = {
        each.name: remove_base(rows, each.large) * rows.weight
        for each in evidence.piecewise
        if each.name in evidence.table
    }
    sided = {each.name for each in evidence.piecewise if each.grid.one_sided}
    pairs = []
    for one, two in combinations(left, 2):
        a, b = left[one], left[two]
        along = a @ b.T
        if {one, two} <= sided:
            # Both bend one way only.
            along = np.maximum(along, 0.0)
        size_a, size_b = np.sum(a**2, axis=1), np.sum(b**2, axis=1)
        share = along**2 / np.maximum(size_a[:, None] * size_b, 1e-300)
        apart = np.minimum(size_a[:, None], size_b) * (1.0 - share)
        alike = np.min(share) > ALIKE
        if alike and np.max(apart) < LEAST_SEEN * noise**2:
            pairs.append((one, two))
    return tuple(pairs)


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
        moved_posterior = model_posterior(table, carried(evidence), evidence.on_noise)
        result[word] = float(moved_posterior.inclusion[effect])
    return result


def _stability(evidence: CaseEvidence, effect: str, rng) -> float | None:
    """Return the share of block-bootstrap samples in which the same effect wins."""
    if effect not in evidence.single.names:
        return None
    names = [NONE, *evidence.single.names]
    best = np.argmax(resampled_evidence(evidence, rng), axis=1)
    return float(np.mean([names[i] == effect for i in best]))
