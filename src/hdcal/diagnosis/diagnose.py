"""Diagnose a case: where, which, how far, and what to test next."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.data.case import Case, require_case
from hdcal.data.plausible import implausible
from hdcal.data.scatter import require_scatter
from hdcal.diagnosis.closure import closure
from hdcal.diagnosis.detection import Detection, detect_gap
from hdcal.diagnosis.library import library_of
from hdcal.diagnosis.next_run import rank_runs
from hdcal.diagnosis.refit import (
    MOST_LEFT_OUT,
    Refits,
    failure_reasons,
    refit,
    with_sampled_size,
)
from hdcal.diagnosis.seen import what_is_seen
from hdcal.diagnosis.stiffness_factors import stiffness_budget
from hdcal.diagnosis.verdict import Closure, Verdict, Which
from hdcal.diagnosis.weighing import weigh
from hdcal.diagnosis.which import identify_cause
from hdcal.errors import Finding, Findings, InputError
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.fewer_rows import thin_rows
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.prediction.engine.pooled import pool
from hdcal.report.words import hypothesis, percent

# Rows from which on a model with a memory takes minutes and more to calibrate.
_MOST_FITTED = 5_000
_NO_GAP = "no gap is detected, so that there is nothing to close"
_NO_CAUSE = "that nothing is missing remains the most probable hypothesis"


# Thousands of small systems are solved, over which threads only wait for each other.
@threadpool_limits.wrap(limits=1, user_api="blas")
def diagnose(
    case: Case,
    *,
    library: Mapping[str, type[Effect]] | None = None,
    quick: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Verdict:
    """Say where model and data part, which effect causes it and how far it closes.

    Args:
        case: from `read_case`.
        library: effects to consider, by name; by default all of them.
        quick: without calibrating the corrected model by NUTS.
        seed: of all random numbers.
        progress: called with (iterations done, iterations in all) while sampling.

    Raises:
        InputError: an effect, a prior or the data cannot be used, see `_check`.
    """
    require_case(case)
    library = library_of(library)
    _check(case, library, seed)
    require_scatter(case)
    rng = np.random.default_rng(seed)
    # Draws of its own: what follows does not depend on how many there were.
    weighed = weigh(case, library, rng.spawn(1)[0])
    diagnosed, library = weighed.case, weighed.library
    evidence, posterior = weighed.evidence, weighed.posterior
    found = detect_gap(evidence, posterior, diagnosed, rng)
    which = identify_cause(evidence, found, diagnosed, library, rng)
    closed = _closure(evidence, which, found, rng)
    fitted = _fitted(case, weighed.averaged_rows * weighed.row_step)
    fits = refit(fitted, posterior, library, seed, progress, quick=quick)
    runs, no_run = rank_runs(evidence, posterior, library, rng)
    return Verdict(
        case=case,
        gap=found.gap(case, closed.ladder[-1].rms_N if closed.ladder else None),
        where=found.where,
        which=with_sampled_size(which, fits),
        shrink=closed,
        next_test=tuple(replace(run, run=case.units.say(run.run)) for run in runs),
        budget=stiffness_budget(evidence, case, which.named, _stiffness(fits)),
        posteriors=dict(fits.models),
        left_out=fits.left_out,
        library=tuple(library),
        notes=(
            *_notes(evidence, fits, weighed.averaged_rows, weighed.row_step),
            *[note for note in fitted.notes if note not in case.notes and not quick],
        ),
        reasons=failure_reasons(fits),
        averaged_rows=weighed.averaged_rows,
        row_step=weighed.row_step,
        no_run=no_run,
        seen=what_is_seen(evidence, diagnosed),
        seed=seed,
        quick=quick,
    )


def _stiffness(fits: Refits) -> np.ndarray | None:
    """Return draws of the stiffness as read over all models [N/mm]."""
    if not fits.models:
        return None
    return pool([*fits.models.values()]).values["stiffness"]


def _check(case: Case, library: Mapping[str, type[Effect]], seed: int) -> None:
    """Refuse priors of unknown effects, and forces that fall with the deformation.

    Raises:
        InputError: an effect has no prior, the gear file
            names an unknown one, or the force does not grow with the deformation; or
            the seed is none.
    """
    with Findings() as wrong:
        wrong += implausible("seed", seed)
    check_effect_priors(case, {**EFFECTS, **library})
    deformation = case.records.deformation - np.mean(case.records.deformation)
    if deformation @ np.asarray(case.records.force) > 0.0:
        return
    units = case.units
    words = f"the {units.load} does not grow with the {units.displacement}"
    remedy = "check the signs of both columns and that the load cell was connected"
    raise InputError([Finding(case.name, words, remedy)])


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


def _notes(evidence: CaseEvidence, fits: Refits, group: int, step: int) -> list[str]:
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
            f"means of {group} neighbouring rows were diagnosed, not single rows"
        )
    if step > 1:
        notes.append(
            f"of every {step} {'rows' if group == 1 else 'means'} one was diagnosed: "
            "neighbours err so much alike that those between say little more"
        )
    if group > 1 or step > 1:
        notes.append("the noise of single rows was not looked at")
    return notes


def _fitted(case: Case, step: int) -> Case:
    """Return the rows that the corrected model is calibrated on.

    Single ones, as it speaks of the noise of a reading, and as far apart as those that
    were diagnosed: those between err like them.

    Args:
        case: all rows.
        step: one of so many rows was diagnosed, or went into a mean.
    """
    rows = len(case.records.force)
    if rows <= _MOST_FITTED:
        return case
    few = thin_rows(case, max(step, -(-rows // _MOST_FITTED)), turns=True)
    words = f"{len(few.records.force)} of {rows} rows were calibrated on, turns kept"
    return replace(few, notes=(*few.notes, words))
