"""From a case to the evidence of every hypothesis: which rows, about which model.

Rows between which nothing can change are one observation. Where neighbours err alike as
far as the hypotheses can take it, they are such rows: a logger read faster than the rig
moves, and some of them say as much. Slow physics is then no longer taken for noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import effect_priors
from hdcal.diagnosis.model_posterior import ModelPosterior, log_priors, posterior_of
from hdcal.evidence.bursts import with_bursts
from hdcal.evidence.case_evidence import UNKNOWN, CaseEvidence
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.fewer_rows import (
    MOST_ROWS,
    average_rows,
    rows_of_half_cycle,
    thin_rows,
)
from hdcal.evidence.hypothesis_design import stiffness_and_noise_beside
from hdcal.evidence.remainder_evidence import with_remainders
from hdcal.evidence.unseen_effects import with_unseen
from hdcal.physics.effect import Effect

# Changes of the stiffness, and of the log of the noise, that move no evidence much.
_SAME_STIFFNESS, _SAME_NOISE = 0.03, 0.3
# One row of so many is kept while the largest correlation is more probable than not,
# again and again, as long as no fewer rows than this are left, in all and of a half
# cycle, which shows neither a bend nor a loop by fewer.
_OF, _FEWEST, _FEWEST_OF_HALF = 3, 100, 5


@dataclass(frozen=True)
class Weighed:
    """What was weighed.

    Attributes:
        case: the case, means of its neighbouring rows, or some of its rows.
        averaged_rows: rows in each mean; 1 is single rows.
        row_step: one of so many rows, or means, of a run was weighed.
        library: effects that these rows can show.
        evidence: of every hypothesis.
        posterior: over them.
    """

    case: Case
    averaged_rows: int
    row_step: int
    library: dict[str, type[Effect]]
    evidence: CaseEvidence
    posterior: ModelPosterior


def weigh(
    case: Case, library: Mapping[str, type[Effect]], rng: np.random.Generator
) -> Weighed:
    """Weigh all hypotheses, on as few rows as say what all of them do.

    Args:
        case: data and gear.
        library: effects to consider, by name.
        rng: of the draws of shares.
    """
    averaged, group = average_rows(case, MOST_ROWS)
    step, most = 1, _largest_step(averaged)
    while True:
        thinned = thin_rows(averaged, step)
        # Means, and rows of what wanders, say nothing of the noise of single rows.
        single = group == 1 and step == 1
        shown = {n: e for n, e in library.items() if single or e.stage != "noise"}
        evidence = _final_evidence(thinned, shown)
        at_the_end = posterior_of(evidence).correlation[-1] > 0.5
        if not at_the_end or _OF * step > most:
            break
        step *= _OF
    evidence = with_remainders(evidence, rng)
    names = list(evidence.table)
    prior = dict(zip(names, log_priors(names, evidence.on_noise), strict=True))
    evidence = with_bursts(evidence, shown, prior)
    evidence = with_unseen(evidence, posterior_of(evidence).inclusion)
    return Weighed(thinned, group, step, shown, evidence, posterior_of(evidence))


def _largest_step(case: Case) -> float:
    """Return how many rows apart those may lie that are left."""
    rows = len(case.records.force)
    return min(rows / _FEWEST, rows_of_half_cycle(case) / _FEWEST_OF_HALF)


def _final_evidence(case: Case, library: dict[str, type[Effect]]) -> CaseEvidence:
    """Compare the hypotheses, a second time where a large effect has bent the first.

    Effects act about a stiffness and the base's priors count against a noise: first
    those of rough fits, which a large effect has biased, then those beside the
    likeliest hypothesis.
    """
    priors = effect_priors(case.gear.full_scale)
    evidence = compute_evidence(case, library, priors)
    top = posterior_of(evidence).top
    names = [name for name in top.split("+") if name in evidence.effects]
    names += [evidence.likeliest_kernel] if top == UNKNOWN else []
    prepared = evidence.prepared
    stiffness, noise_sd = stiffness_and_noise_beside(evidence, names)
    moved = abs(stiffness / float(prepared.base.stiffness) - 1.0) > _SAME_STIFFNESS
    noisier = abs(np.log(noise_sd / prepared.noise_sd)) > _SAME_NOISE
    if stiffness <= 0.0 or noise_sd <= 0.0 or not (moved or noisier):
        return evidence
    return compute_evidence(
        case, library, priors, stiffness=stiffness, noise_sd=noise_sd
    )
