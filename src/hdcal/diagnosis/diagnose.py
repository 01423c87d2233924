"""Diagnose a case: where model and readings part, which effect causes it, how far."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from hdcal.calibration.known_effects import check_effect_priors
from hdcal.data.case import Case, from_contact, require_case
from hdcal.data.plausible import implausible
from hdcal.data.scatter import require_scatter
from hdcal.data.theory_names import SPRING
from hdcal.diagnosis.acting import CARRIED
from hdcal.diagnosis.charts import FORMULA
from hdcal.diagnosis.decision import TEMPERATURE, Decision, decide
from hdcal.diagnosis.gap import (
    Fitted,
    closed_on_left_out,
    fitted,
    gap_by_row,
    nearest_effects,
)
from hdcal.diagnosis.library import library_of
from hdcal.diagnosis.next_run import rank_runs
from hdcal.diagnosis.patterns import find_patterns
from hdcal.diagnosis.refit import Refits, refit, rows_to_calibrate
from hdcal.diagnosis.result import Data, Diagnosis, Gap, HowFar, Nearest, Refit, Rung
from hdcal.diagnosis.which import LIKELY, Which
from hdcal.errors import Finding, Findings, InputError
from hdcal.evidence.noise_models import OUTLIERS
from hdcal.evidence.search import Searched, search
from hdcal.evidence.table import OUTSIDE
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.physics.theory import THEORIES
from hdcal.report.item import Interval
from hdcal.report.words import label
from hdcal.versions import versions

if TYPE_CHECKING:
    from hdcal.inference.sample import Progress


# Thousands of small systems are solved, over which threads only wait for each other.
@threadpool_limits.wrap(limits=1, user_api="blas")
def diagnose(
    case: Case,
    *,
    library: Mapping[str, type[Effect]] | None = None,
    quick: bool = False,
    seed: int = 0,
    progress: "Progress | None" = None,
) -> Diagnosis:
    """Find where model and readings part, which effect causes it, how far it closes.

    Args:
        case: from `read_case`.
        library: effects to consider, by name; by default all of them.
        quick: without calibrating the models that are left.
        seed: of all random numbers.
        progress: called with the iterations done and all of them while sampling.

    Raises:
        InputError: library or seed is invalid, an effect has no prior, the force does
            not grow with the deformation, or readings do not scatter.
    """
    require_case(case)
    effects = library_of(library)
    _check(case, effects, seed)
    rng = np.random.default_rng(seed)
    read, case = case, from_contact(case)
    searched = search(case, effects)
    found = decide(searched, seed=seed)
    posterior = searched.table.posterior(TEMPERATURE)
    fit = fitted(searched, posterior, found.which.leaders)
    excluded = [
        f"{label(name)} is excluded: the gear file fixes its amplitude at zero"
        for name in searched.excluded
    ]
    calibrated, fits = read, Refits({}, None, ())
    if not quick:
        calibrated = rows_to_calibrate(read)
        fits = refit(calibrated, found.hypotheses, effects, seed, progress)
    return Diagnosis(
        part="part" if case.gear.theory == SPRING else "gear",
        units=case.units,
        gap=_gap(case, found, fit),
        seen=find_patterns(searched.problem, case),
        which=found.which,
        how_far=_how_far(case, searched, found.which, fit, rng),
        next_test=tuple(
            run.model_copy(update={"run": case.units.say(run.run)})
            for run in rank_runs(searched, posterior)
        ),
        refits=_refits(fits),
        left_out=fits.left_out,
        stiffness_N_per_mm=_stiffness(fits),
        reasons=() if fits.posteriors else fits.failures,
        coarse_step_N=searched.coarse_step,
        library=tuple(effects),
        seed=seed,
        versions=versions(),
        data=_data(case, searched, (*calibrated.notes, *excluded, *fits.failures)),
        case=read,
        rows=gap_by_row(searched, posterior, rng),
        posteriors=dict(fits.posteriors),
    )


def _check(case: Case, effects: Mapping[str, type[Effect]], seed: int) -> None:
    """Refuse a case that cannot be diagnosed.

    Raises:
        InputError: holds the reason.
    """
    with Findings() as wrong:
        wrong += implausible("seed", seed)
    check_effect_priors(case, {**EFFECTS, **effects})
    require_scatter(case)
    records = case.records
    x, force = np.asarray(records.deformation), np.asarray(records.force)
    # Of a part that yields the whole curve may fall, but not from row to row.
    step = np.diff(x) * (np.diff(records.run) == 0)
    if (x - x.mean()) @ force > 0.0 or step @ np.diff(force) > 0.0:
        return
    units = case.units
    words = f"the {units.load} does not increase with the {units.displacement}"
    remedy = "Check the signs of both columns and the connection of the load cell"
    raise InputError([Finding(case.name, words, remedy)])


def _gap(case: Case, found: Decision, fit: Fitted) -> Gap:
    """Return size and probability of the gap; its size where it is on the mean."""
    which, size = found.which, found.gap_N
    if not (which.on_mean or which.outside.probability > LIKELY):
        size = None
    largest = float(np.max(np.abs(case.records.force)))
    return Gap(
        probability=found.gap,
        rms_N=size,
        noise_sd_N=fit.noise_sd,
        share_of_full_scale=size.median / largest if size else None,
        correlation=fit.noise.correlation,
    )


def _data(case: Case, searched: Searched, notes: tuple[str, ...]) -> Data:
    """Return which data they were."""
    return Data(
        name=case.name,
        rows=len(case.records.force),
        rows_diagnosed=len(searched.problem.y),
        sha256=case.data_sha256,
        notes=notes,
    )


def _refits(fits: Refits) -> tuple[Refit, ...]:
    """Return the calibrated hypotheses, the most probable first."""
    ranked = sorted(fits.posteriors.items(), key=lambda item: -item[1][0])
    return tuple(
        Refit(
            hypothesis=name,
            probability=chance,
            stiffness_N_per_mm=Interval.of(fit.draws["stiffness"]),
        )
        for name, (chance, fit) in ranked
    )


def _stiffness(fits: Refits) -> Interval | None:
    """Return the stiffness as read over all models [N/mm].

    None where it means different things: beside an effect that bends the curve it is
    the slope of one part of it. None also where most hypotheses have no calibration.
    """
    if fits.left_out and fits.left_out.probability > LIKELY:
        return None
    bends = {
        frozenset(e.name for e in fit.effects if e.family.startswith("curve"))
        for _, fit in fits.posteriors.values()
    }
    if len(bends) != 1:
        return None
    from hdcal.prediction.models import joint_draws, models_of

    models = models_of([*fits.posteriors.values()])
    return Interval.of(joint_draws(models, "stiffness"))


def _how_far(
    case: Case,
    searched: Searched,
    which: Which,
    fit: Fitted,
    rng: np.random.Generator,
) -> HowFar:
    closed, word, nearest = None, "", None
    if which.on_mean:
        closed, word = closed_on_left_out(searched, fit, which.leaders, rng)
    if which.mostly_outside:
        effects, share = nearest_effects(searched, fit)
        acting = {name for cause in which.on_mean for name in cause.members}
        if share >= CARRIED and acting.isdisjoint(effects):
            nearest = Nearest(effects=effects, explains=share)
    ladder = [] if case.gear.theory == SPRING else [_formula(case, searched)]
    for name, size in fit.rms.items():
        if name != OUTSIDE or len(fit.rms) > 1:
            words = "outside the library" if name == OUTSIDE else label(name)
            model = f"+ {words}" if name else "calibrated straight model"
            ladder.append(Rung(model=model, rms_N=size))
    wild = fit.noise.name == OUTLIERS
    noise = "noise without outliers" if wild else "noise"
    ladder.append(Rung(model=noise, rms_N=fit.noise_sd))
    return HowFar(ladder=tuple(ladder), closed=closed, left_out=word, nearest=nearest)


def _formula(case: Case, searched: Searched) -> Rung:
    """Return what the formula itself leaves: K = 1, no offset."""
    gear, problem = case.gear, searched.problem
    stiffness = THEORIES[gear.theory](gear.geometry, gear.priors["E0"].numbers[0])
    base = Base(float(stiffness), problem.base.alpha, 0.0, 0.0, 1.0)
    force = predict_reading(base, (), problem.records, problem.reading)[0]
    left = np.asarray(problem.records.force) - np.asarray(force)
    return Rung(model=FORMULA, rms_N=float(np.sqrt(np.mean(left**2))))
