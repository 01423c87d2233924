"""Which effect causes the gap: posterior over hypotheses, and how firm it is."""

from itertools import combinations, starmap

import numpy as np

from hdcal.diagnosis.amplitude import amplitude_of
from hdcal.diagnosis.model_posterior import (
    NAMED,
    ModelPosterior,
    model_posterior,
    verdict_word,
)
from hdcal.diagnosis.verdict import NotTestable, Which
from hdcal.evidence.case_evidence import LEAST_SEEN, NONE, CaseEvidence
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.resampled_evidence import resampled_evidence
from hdcal.evidence.single_evidence import rescaled_change
from hdcal.physics.effect import Effect

# Squared correlation, beside the base model, from which two shapes look alike.
_ALIKE = 0.8


def identify_cause(
    evidence: CaseEvidence,
    posterior: ModelPosterior,
    detected: bool,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Which:
    """Return the verdict on the cause."""
    word = verdict_word(posterior, detected)
    ranked = sorted(posterior.inclusion, key=lambda n: -posterior.inclusion[n])
    named = word in ("named", "ambiguous") and bool(ranked)
    effect = ranked[0] if named else None
    others = [n for n in ranked[1:] if posterior.inclusion[n] >= NAMED]
    return Which(
        verdict=word,
        effect=effect,
        second_effect=others[0] if named and others else None,
        set=posterior.smallest_set if word != "none" else (NONE,),
        probabilities=posterior.probabilities,
        inclusion=posterior.inclusion,
        log_evidence=posterior.log_evidence,
        amplitude=amplitude_of(evidence, effect, library, rng) if effect else None,
        not_testable=tuple(starmap(NotTestable, evidence.not_testable.items())),
        not_excited=evidence.not_excited,
        inseparable=inseparable(evidence),
        sensitivity=sensitivity(evidence, effect) if effect else {},
        stability=_stability(evidence, effect, rng) if effect else None,
    )


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
    pairs = []
    for one, two in combinations(left, 2):
        a, b = left[one], left[two]
        size_a, size_b = np.sum(a**2, axis=1), np.sum(b**2, axis=1)
        share = (a @ b.T) ** 2 / np.maximum(size_a[:, None] * size_b, 1e-300)
        apart = np.minimum(size_a[:, None], size_b) * (1.0 - share)
        alike = np.min(share) > _ALIKE
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
        result[word] = float(model_posterior(table).inclusion[effect])
    return result


def _stability(evidence: CaseEvidence, effect: str, rng) -> float | None:
    """Return the share of block-bootstrap samples in which the same effect wins."""
    if effect not in evidence.single.names:
        return None
    names = [NONE, *evidence.single.names]
    best = np.argmax(resampled_evidence(evidence, rng), axis=1)
    return float(np.mean([names[i] == effect for i in best]))
