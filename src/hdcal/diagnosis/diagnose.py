"""Diagnose a case: where, which, how far, and what to test next."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.calibration.calibrate import calibrate, check_effect_priors
from hdcal.data.case import Case
from hdcal.data.priors import effect_priors
from hdcal.diagnosis.adequacy import move_inadequate_to_unknown
from hdcal.diagnosis.closure import closure
from hdcal.diagnosis.model_posterior import ModelPosterior, model_posterior
from hdcal.diagnosis.next_run import rank_runs
from hdcal.diagnosis.stiffness_factors import stiffness_budget
from hdcal.diagnosis.verdict import Closure, Gap, Verdict, Which
from hdcal.diagnosis.where import (
    FALSE_ALARM,
    declared_directions,
    describe_where,
    interval,
)
from hdcal.diagnosis.which import identify_cause
from hdcal.errors import Finding, InputError
from hdcal.evidence.case_evidence import NONE, QUANTISATION, UNKNOWN, CaseEvidence
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.hypothesis_design import stiffness_and_noise_beside
from hdcal.evidence.residual_test import ResidualTest, residual_test
from hdcal.evidence.row_means import average_rows
from hdcal.evidence.smooth_gap import (
    AdditiveBasis,
    SmoothGap,
    additive_basis,
    fit_smooth_gap,
)
from hdcal.inference.posterior import Posterior
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.report.parameters import Interval

# Members of the set that are calibrated for the bands, and their least probability.
_MOST_REFITS, _LEAST_SHARE = 3, 0.05
# Changes of the stiffness, and of the log of the noise, that move no evidence much.
_SAME_STIFFNESS, _SAME_NOISE = 0.03, 0.3
_NO_GAP = "no gap is detected, so that there is nothing to close"
_NOT_SEEN = Interval(np.nan, np.nan, np.nan)
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

    Returns:
        The verdict; it may be none, ambiguous or unknown.

    Raises:
        InputError: an effect has no prior, the gear file names an unknown one, or the
            force does not grow with the deformation.
    """
    check_effect_priors(case, {**EFFECTS, **library})
    _check_rise(case)
    rng = np.random.default_rng(seed)
    library = dict(library)
    averaged, group = average_rows(case)
    if group > 1:
        library = {n: e for n, e in library.items() if e.stage != "noise"}
    evidence, posterior = _evidence_and_posterior(averaged, library)
    correlation = float(posterior.correlation @ evidence.prepared.rows.correlations)
    cells, directions = declared_directions(evidence, averaged)
    tested = residual_test(evidence.prepared, correlation, directions, rng)
    rounded = QUANTISATION in posterior.top.split("+")
    detected = tested.p_value <= FALSE_ALARM or rounded
    smooth = basis = None
    if detected:
        # Draws of its own: what follows does not depend on how many were tested.
        posterior = move_inadequate_to_unknown(
            evidence, posterior, averaged, correlation, rng.spawn(1)[0]
        )
        basis = additive_basis(evidence.prepared)
        smooth = fit_smooth_gap(evidence.prepared, basis, correlation, rng)
    which = identify_cause(evidence, posterior, detected, library, rng)
    closed = _closure(evidence, which, basis, correlation, rng)
    posteriors = {} if quick else refit(case, which, posterior, library, seed, progress)
    failed = [n for n, (_, p) in posteriors.items() if not p.usable]
    runs, no_run = rank_runs(evidence, posterior, library, rng)
    step = evidence.rounding_step if rounded and tested.p_value > FALSE_ALARM else None
    return Verdict(
        case=case,
        gap=_gap(case, posterior, tested, smooth, closed, correlation, step),
        where=describe_where(evidence, averaged, cells, tested, smooth),
        which=_sampled_size(which, posteriors),
        shrink=closed,
        next_test=runs,
        budget=stiffness_budget(evidence, case, _named(which)),
        posteriors={n: p for n, p in posteriors.items() if n not in failed},
        library=tuple(library),
        notes=tuple(_notes(evidence, which, list(posteriors), failed, group)),
        reasons=_reasons(posteriors, failed),
        averaged_rows=group,
        no_run=no_run,
    )


def _named(which: Which) -> list[str]:
    return [name for name in (which.effect, which.second_effect) if name]


def _gap(
    case: Case,
    posterior: ModelPosterior,
    tested: ResidualTest,
    smooth: SmoothGap | None,
    closed: Closure,
    correlation: float,
    rounding_step: float | None,
) -> Gap:
    """Return whether there is a gap and how large it is."""
    size = _NOT_SEEN if smooth is None else interval(smooth.rms)
    return Gap(
        smooth is not None,
        1.0 - posterior.probabilities[NONE],
        size,
        closed.ladder[-1].rms_N if closed.ladder else tested.noise_sd,
        size.median / float(np.max(np.abs(case.records.force))),
        correlation,
        rounding_step,
    )


def _closure(
    evidence: CaseEvidence,
    which: Which,
    basis: AdditiveBasis | None,
    correlation: float,
    rng: np.random.Generator,
) -> Closure:
    """Return how far the named effects close the gap, or why there is none to close."""
    if basis is None or which.verdict == "none":
        reason = _NO_GAP if basis is None else _NO_CAUSE
        return Closure((), None, "", None, None, None, reason)
    effects = {*evidence.single.names, *evidence.subspace_effects}
    members = [name for name in which.set if name in effects]
    return closure(evidence, _named(which), members, basis, correlation, rng)


def _reasons(posteriors: Mapping, failed: list[str]) -> tuple[str, ...]:
    """Say why nothing may be used: every calibration failed."""
    if len(failed) < len(posteriors):
        return ()
    return tuple(
        f"the calibration with {name} failed its checks: "
        + "; ".join(posteriors[name][1].reasons)
        for name in failed
    )


def _check_rise(case: Case) -> None:
    """Refuse forces that do not grow with the deformation: no stiffness is negative."""
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


def refit(
    case: Case,
    which: Which,
    posterior: ModelPosterior,
    library: dict[str, type[Effect]],
    seed: int,
    progress: Progress | None,
) -> dict[str, tuple[float, Posterior]]:
    """Calibrate the corrected model by NUTS: the name, or each member of the set.

    Returns:
        Probability and posterior by hypothesis; `none` for the plain model and
        `unknown` for the plain model with a leftover gap.
    """
    if which.verdict in ("none", "unknown"):
        chosen = {which.verdict: 1.0}
    elif which.verdict == "named" and which.effect:
        chosen = {"+".join(sorted(_named(which))): 1.0}
    else:
        share = sorted(posterior.probabilities.items(), key=lambda item: -item[1])
        kept = [item for item in share if item[1] >= _LEAST_SHARE][:_MOST_REFITS]
        total = sum(probability for _, probability in kept)
        chosen = {name: probability / total for name, probability in kept}
    result = {}
    for name, share in chosen.items():
        effects = () if name in (NONE, UNKNOWN) else tuple(name.split("+"))
        calibrated = calibrate(
            case,
            effects=effects,
            with_gap=name == UNKNOWN,
            seed=seed,
            registry=library,
            progress=progress,
        )
        result[name] = (share, calibrated)
    return result


def _sampled_size(
    which: Which, posteriors: dict[str, tuple[float, Posterior]]
) -> Which:
    """Return the verdict with the named effect's size from its calibration.

    There the zero of the deformation is inferred too, about which the closed form
    only expands.
    """
    size = which.amplitude
    likeliest = max(posteriors, key=lambda name: posteriors[name][0], default=None)
    if size is None or likeliest is None or size.effect not in likeliest.split("+"):
        return which
    _, posterior = posteriors[likeliest]
    draws = posterior.draws.get(f"{size.effect}.{size.parameter}")
    if draws is None or not posterior.usable:
        return which
    return replace(which, amplitude=replace(size, size=interval(draws)))


def _notes(
    evidence: CaseEvidence,
    which: Which,
    refitted: list[str],
    failed: list[str],
    group: int,
) -> list[str]:
    notes = [
        f"{name} is accounted for by the gear file's force_resolution_N"
        for name in evidence.accounted
    ]
    notes += [
        f"the calibration with {name} failed its checks and is left out of the bands"
        for name in failed
    ]
    dropped = {*which.set} - {part for name in refitted for part in name.split("+")}
    if refitted and dropped and which.verdict == "ambiguous":
        notes.append("only the likeliest members of the set are in the bands")
    if group > 1:
        notes.append(
            f"means of {group} neighbouring rows were diagnosed, not single rows; the "
            "noise of single rows was not looked at"
        )
    return notes
