"""Diagnose a case: where, which, how far, and what to test next."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.calibration.calibrate import calibrate, check_effect_priors
from hdcal.data.case import Case
from hdcal.data.priors import effect_priors
from hdcal.diagnosis.adequacy import doubt
from hdcal.diagnosis.closure import shrink
from hdcal.diagnosis.model_posterior import Weighed, weigh
from hdcal.diagnosis.next_run import rank_runs
from hdcal.diagnosis.stiffness_factors import budget
from hdcal.diagnosis.verdict import Gap, Shrink, Verdict, Which
from hdcal.diagnosis.where import FALSE_ALARM, describe, interval, look
from hdcal.diagnosis.which import answer
from hdcal.errors import Finding, InputError
from hdcal.evidence.additive_gap import additive_basis, fit_additive
from hdcal.evidence.assess import assess
from hdcal.evidence.assessment import (
    NONE,
    QUANTISATION,
    UNKNOWN,
    Assessment,
    expansion_beside,
)
from hdcal.evidence.row_means import shorten
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
    short, group = shorten(case)
    if group > 1:
        library = {n: e for n, e in library.items() if e.stage != "noise"}
    found, weighed = _weigh_twice(short, library)
    correlation = float(
        weighed.correlation @ np.asarray(found.setting.rows.correlations)
    )
    cells, tested = look(found, short, correlation, rng)
    rounded = QUANTISATION in weighed.top.split("+")
    detected = tested.p_value <= FALSE_ALARM or rounded
    if detected:
        # Draws of its own: what follows does not hang on how many were doubted.
        weighed = doubt(found, weighed, short, correlation, rng.spawn(1)[0])
    smooth = basis = None
    if detected:
        basis = additive_basis(found.setting)
        smooth = fit_additive(found.setting, basis, correlation, rng)
    which = answer(found, weighed, detected, library, rng)
    names = [n for n in (which.effect, which.second_effect) if n]
    if basis is None:
        far = _nothing_shrinks(_NO_GAP)
    elif which.verdict == "none":
        far = _nothing_shrinks(_NO_CAUSE)
    else:
        members = [n for n in which.set if n in found.singles.names or n in found.wide]
        far = shrink(found, names, members, basis, correlation, rng)
    posteriors = {} if quick else refit(case, which, weighed, library, seed, progress)
    failed = [n for n, (_, p) in posteriors.items() if not p.usable]
    runs, no_run = rank_runs(found, weighed, library, rng)
    size = interval(smooth.rms) if smooth is not None else _NOT_SEEN
    return Verdict(
        case=case,
        gap=Gap(
            detected,
            1.0 - weighed.probabilities[NONE],
            size,
            far.ladder[-1].rms_N if far.ladder else tested.noise_sd,
            size.median / float(np.max(np.abs(case.records.force))),
            correlation,
            found.step if rounded and tested.p_value > FALSE_ALARM else None,
        ),
        where=describe(found, short, cells, tested, smooth, detected),
        which=_sampled_size(which, posteriors),
        shrink=far,
        next_test=runs,
        budget=budget(found, case, names),
        posteriors={n: p for n, p in posteriors.items() if n not in failed},
        library=tuple(library),
        notes=tuple(_notes(found, which, list(posteriors), failed, group)),
        reasons=_reasons(posteriors, failed),
        averaged_rows=group,
        no_run=no_run,
    )


def _nothing_shrinks(reason: str) -> Shrink:
    return Shrink((), None, "", None, None, None, reason)


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
    told = case.records
    deformation = told.deformation - np.mean(told.deformation)
    if deformation @ np.asarray(told.force) > 0.0:
        return
    words = "the force does not grow with the deformation"
    remedy = "check the signs of both columns and that the load cell was connected"
    raise InputError([Finding(case.name, words, remedy)])


def _weigh_twice(
    case: Case, library: dict[str, type[Effect]]
) -> tuple[Assessment, Weighed]:
    """Weigh the hypotheses, a second time where a large effect has bent the first.

    Effects act about a stiffness and the base's priors count against a noise: first
    those of rough fits, which a large effect has biased, then those beside the
    likeliest hypothesis.
    """
    priors = effect_priors()
    found = assess(case, library, priors)
    weighed = weigh(found.table)
    names = [name for name in weighed.top.split("+") if name in found.effects]
    setting = found.setting
    stiffness, noise_sd = expansion_beside(found, names)
    moved = abs(stiffness / float(setting.base.stiffness) - 1.0) > _SAME_STIFFNESS
    noisier = abs(np.log(noise_sd / setting.noise_sd)) > _SAME_NOISE
    if stiffness <= 0.0 or noise_sd <= 0.0 or not (moved or noisier):
        return found, weighed
    found = assess(case, library, priors, stiffness=stiffness, noise_sd=noise_sd)
    return found, weigh(found.table)


def refit(
    case: Case,
    which: Which,
    weighed: Weighed,
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
        both = [n for n in (which.effect, which.second_effect) if n]
        chosen = {"+".join(sorted(both)): 1.0}
    else:
        share = sorted(weighed.probabilities.items(), key=lambda item: -item[1])
        kept = [item for item in share if item[1] >= _LEAST_SHARE][:_MOST_REFITS]
        total = sum(probability for _, probability in kept)
        chosen = {name: probability / total for name, probability in kept}
    result = {}
    for name, share in chosen.items():
        effects = () if name in (NONE, UNKNOWN) else tuple(name.split("+"))
        posterior = calibrate(
            case,
            effects=effects,
            with_gap=name == UNKNOWN,
            seed=seed,
            registry=library,
            progress=progress,
        )
        result[name] = (share, posterior)
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
    found: Assessment, which: Which, refitted: list[str], failed: list[str], group: int
) -> list[str]:
    notes = [
        f"{name} is accounted for by the gear file's force_resolution_N"
        for name in found.accounted
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
