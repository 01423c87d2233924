"""Diagnose a case: where, which, how far, and what to test next."""

from collections.abc import Mapping

import numpy as np

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.data.priors import effect_priors
from hdcal.diagnosis.closure import closure
from hdcal.diagnosis.detection import Detection, detect_gap
from hdcal.diagnosis.model_posterior import ModelPosterior, model_posterior
from hdcal.diagnosis.next_run import rank_runs
from hdcal.diagnosis.refit import (
    MOST_LEFT_OUT,
    Refits,
    failure_reasons,
    refit,
    with_sampled_size,
)
from hdcal.diagnosis.stiffness_factors import stiffness_budget
from hdcal.diagnosis.verdict import Closure, Verdict, Which
from hdcal.diagnosis.which import identify_cause
from hdcal.errors import Finding, Findings, InputError
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.hypothesis_design import stiffness_and_noise_beside
from hdcal.evidence.row_means import average_rows
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.report.words import hypothesis, percent

# Changes of the stiffness, and of the log of the noise, that move no evidence much.
_SAME_STIFFNESS, _SAME_NOISE = 0.03, 0.3
_NO_GAP = "no gap is detected, so that there is nothing to close"
_NO_CAUSE = "that nothing is missing remains the most probable hypothesis"


def diagnose(
    case: Case,
    *,
    library: Mapping[str, type[Effect]] = EFFECTS,
    quick: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Verdict:
    """Say where model and data part, which effect causes it and how far it closes.

    Args:
        case: from `read_case`.
        library: effects to consider, by name.
        quick: without calibrating the corrected model by NUTS.
        seed: of all random numbers.
        progress: called with (iterations done, iterations in all) while sampling.

    Raises:
        InputError: an effect, a prior or the data cannot be used, see `_check`.
    """
    _check(case, library, seed)
    rng = np.random.default_rng(seed)
    averaged, group, library = _averaged(case, library)
    evidence, posterior = _evidence_and_posterior(averaged, library)
    found = detect_gap(evidence, posterior, averaged, rng)
    which = identify_cause(evidence, found.posterior, found.detected, library, rng)
    closed = _closure(evidence, which, found, rng)
    fits = refit(case, found.posterior, library, seed, progress, quick=quick)
    runs, no_run = rank_runs(evidence, found.posterior, library, rng)
    return Verdict(
        case=case,
        gap=found.gap(case, closed.ladder[-1].rms_N if closed.ladder else None),
        where=found.where,
        which=with_sampled_size(which, fits),
        shrink=closed,
        next_test=runs,
        budget=stiffness_budget(evidence, case, which.named),
        posteriors=dict(fits.models),
        left_out=fits.left_out,
        library=tuple(library),
        notes=tuple(_notes(evidence, fits, group)),
        reasons=failure_reasons(fits),
        averaged_rows=group,
        no_run=no_run,
        seed=seed,
        quick=quick,
    )


def _averaged(
    case: Case, library: Mapping[str, type[Effect]]
) -> tuple[Case, int, dict[str, type[Effect]]]:
    """Return means of rows, of how many each, and the effects that these can show."""
    averaged, group = average_rows(case)
    # They say nothing of the noise of single rows.
    shown = {n: e for n, e in library.items() if group == 1 or e.stage != "noise"}
    return averaged, group, shown


def _check(case: Case, library: Mapping[str, type[Effect]], seed: int) -> None:
    """Refuse priors of unknown effects, and forces that fall with the deformation.

    Raises:
        InputError: an effect has no prior or does not bear padded rows, the gear file
            names an unknown one, or the force does not grow with the deformation; or
            the seed is none.
    """
    with Findings() as wrong:
        wrong += implausible("seed", seed)
    check_effect_priors(case, {**EFFECTS, **library})
    deformation = case.records.deformation - np.mean(case.records.deformation)
    if deformation @ np.asarray(case.records.force) > 0.0:
        return
    words = "the force does not grow with the deformation"
    remedy = "check the signs of both columns and that the load cell was connected"
    raise InputError([Finding(case.name, words, remedy)])


def _evidence_and_posterior(
    case: Case, library: dict[str, type[Effect]]
) -> tuple[CaseEvidence, ModelPosterior]:
    """Compare the hypotheses, a second time where a large effect has bent the first.

    Effects act about a stiffness and the base's priors count against a noise: first
    those of rough fits, which a large effect has biased, then those beside the
    likeliest hypothesis.
    """
    priors = effect_priors()
    evidence = compute_evidence(case, library, priors)
    posterior = model_posterior(evidence.table)
    names = [name for name in posterior.top.split("+") if name in evidence.effects]
    prepared = evidence.prepared
    stiffness, noise_sd = stiffness_and_noise_beside(evidence, names)
    moved = abs(stiffness / float(prepared.base.stiffness) - 1.0) > _SAME_STIFFNESS
    noisier = abs(np.log(noise_sd / prepared.noise_sd)) > _SAME_NOISE
    if stiffness <= 0.0 or noise_sd <= 0.0 or not (moved or noisier):
        return evidence, posterior
    evidence = compute_evidence(
        case, library, priors, stiffness=stiffness, noise_sd=noise_sd
    )
    return evidence, model_posterior(evidence.table)


def _closure(
    evidence: CaseEvidence, which: Which, found: Detection, rng: np.random.Generator
) -> Closure:
    """Return how far the named effects close the gap, or why there is none to close."""
    if found.basis is None or which.verdict == "none":
        reason = _NO_GAP if found.basis is None else _NO_CAUSE
        return Closure((), None, "", None, None, None, reason)
    effects = {*evidence.single.names, *evidence.subspace_effects}
    members = [name for name in which.set if name in effects]
    return closure(evidence, which.named, members, found.basis, found.correlation, rng)


def _notes(evidence: CaseEvidence, fits: Refits, group: int) -> list[str]:
    notes = [
        f"{name} is accounted for by the gear file's force_resolution_N"
        for name in evidence.accounted
    ]
    notes += [
        f"the calibration with {name} failed its checks and is left out of the bands"
        for name in fits.failed
    ]
    left = fits.left_out
    if left is not None and left.probability >= 0.5 * MOST_LEFT_OUT:
        notes.append(
            f"{percent(left.probability)} of the probability lies on hypotheses that "
            f"were not calibrated; in the bands it counts as "
            f"{hypothesis(left.counted_as)}"
        )
    if group > 1:
        notes.append(
            f"means of {group} neighbouring rows were diagnosed, not single rows; the "
            "noise of single rows was not looked at"
        )
    return notes
