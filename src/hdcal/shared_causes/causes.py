"""Which effects many gears have, and how frequent each one is."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from hdcal.calibration.known_effects import check_effect_priors
from hdcal.cli.processes import run_all
from hdcal.data.case import Case
from hdcal.data.measurements.bad_gears import cause as fault
from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.data.plausible import implausible
from hdcal.data.theory_names import SPRING
from hdcal.diagnosis.decision import TEMPERATURE
from hdcal.diagnosis.library import library_of
from hdcal.errors import Finding, Findings
from hdcal.evidence.table import OUTSIDE
from hdcal.inference.checks import mixing_checks
from hdcal.inference.diagnostics import have_mixed, mixing
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.report.item import Interval
from hdcal.shared_causes.frequencies import Frequencies, sample_frequencies
from hdcal.shared_causes.gear_evidence import NONE, Weight, weigh_gear
from hdcal.shared_causes.gears import read_gears, usable_gears, without_bad
from hdcal.shared_causes.result import RARE, FleetCauses, GearCauses, SharedCause
from hdcal.versions import versions

# Number of gears that the prior of the frequencies counts as.
_COUNTS = 1.0
# Draws of each chain, and the most where similar causes mix slowly.
_CHAINS, _DRAWS, _MOST_DRAWS = 4, 1500, 12_000
# Differences between runs and between gears are a question to the fleet.
_OF_FLEETS = {"runs", "specimens"}
# Probability of the set of causes of a gear.
_CREDIBLE = 0.9
# Log odds that are substantial (Jeffreys, Theory of Probability, 1961).
_SUBSTANTIAL = 0.5 * np.log(10.0)


def causes(
    data: Any,
    gear: Any = None,
    *,
    columns: Mapping[str, str] | None = None,
    library: Mapping[str, type[Effect]] | None = None,
    jobs: int = 1,
    skip_bad: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> FleetCauses:
    """Find which effects many gears have, and how frequent each one is.

    Args:
        data: readings of many gears: a case; a table or file as `read_case` takes it,
            with a column `specimen`; or a folder with a file, or a folder, for each.
        gear: gear file, or its content, as in `read_case`.
        columns: as in `read_case`.
        library: effects to consider, by name; by default all of them.
        jobs: processes that share the gears.
        skip_bad: leave out gears with a fault, with too few readings, or whose evidence
            fails.
        seed: of all random numbers.
        progress: called with (gears done, gears in all).

    Raises:
        InputError: there are too few gears, or one of them cannot be diagnosed.
    """
    with Findings() as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
        effects = wrong.attempt(library_of, library)
    assert effects is not None
    readings = read_gears(data, gear, columns=columns)
    usable = usable_gears(readings, skip_bad=skip_bad)
    how = {"jobs": jobs, "skip_bad": skip_bad, "seed": seed, "progress": progress}
    return causes_of(*usable, effects, **how)


def causes_of(
    case: Case,
    gears: Mapping[str, Case],
    left_out: Mapping[str, Finding],
    effects: Mapping[str, type[Effect]],
    *,
    jobs: int,
    skip_bad: bool,
    seed: int,
    progress: Progress | None,
) -> FleetCauses:
    """Return the result for `usable_gears`; the others are arguments of `causes`."""
    check_effect_priors(case, {**EFFECTS, **effects})
    effects = {n: e for n, e in effects.items() if not e.needs & _OF_FLEETS}
    tasks = [(each, effects, seed) for each in gears.values()]
    weights = dict(zip(gears, run_all(weigh_gear, tasks, jobs, progress), strict=True))
    failed = {gear: w for gear, w in weights.items() if isinstance(w, Finding)}
    gears = without_bad(gears, failed, skip_bad=skip_bad)
    left_out = {**left_out, **failed}
    return _together(case, gears, [weights[g] for g in gears], left_out, effects, seed)


def _together(
    case: Case,
    gears: Mapping[str, Case],
    weights: Sequence[Mapping[str, Weight]],
    left_out: Mapping[str, Finding],
    library: Iterable[str],
    seed: int,
) -> FleetCauses:
    """Return frequencies and causes from the evidence of each gear."""
    present = {name for weight in weights for name in weight}
    names = [name for name in (NONE, *library, OUTSIDE) if name in present]
    evidence = pd.DataFrame([{c: w[c].log_evidence for c in w} for w in weights])
    log_prior = pd.DataFrame([{c: w[c].log_prior for c in w} for w in weights])
    # An effect without a prediction for a gear has the evidence of none there.
    gain = evidence[names].sub(evidence[NONE], axis=0).fillna(0.0).to_numpy()
    prior = np.exp(log_prior[names].fillna(-np.inf).to_numpy())
    # Log odds are divided as in a diagnosis, where that calibrates probabilities.
    tempered = gain / TEMPERATURE
    alone = prior * np.exp(tempered - tempered.max(axis=1, keepdims=True))
    alone /= alone.sum(axis=1, keepdims=True)
    drawn, checked = _sampled(tempered, prior.mean(axis=0), names, seed)
    checks = mixing_checks(mixing(checked), _CHAINS)
    reasons = tuple(check.words for check in checks if check.outcome == "failed")
    confounded = _confounded(names, drawn.chance, alone)
    sets = [_credible_set(names, row, confounded) for row in drawn.chance]
    why = {gear: fault(finding) for gear, finding in left_out.items()}
    words = [left_out_words(left_out, len(sets) + len(why))] if why else []
    used = [
        GearCauses(
            gear=label,
            lot=gear.lots[0] if gear.lots else None,
            rows=len(gear.records.force),
            causes=" / ".join(sets[k]),
            probability=float(drawn.chance[k].max()),
            probability_none=float(drawn.chance[k, names.index(NONE)]),
            alone=names[int(alone[k].argmax())],
            probability_alone=float(alone[k].max()),
            status="failed" if reasons else "ok",
        )
        for k, (label, gear) in enumerate(gears.items())
    ]
    unused = [GearCauses(gear=g, status=f"left out: {w}") for g, w in why.items()]
    return FleetCauses(
        part="part" if case.gear.theory == SPRING else "gear",
        units=case.units,
        reasons=reasons,
        gears=len(gears),
        rows=sum(len(gear.records.force) for gear in gears.values()),
        left_out=why,
        causes=_shared(names, drawn, sets, gain),
        not_shown=tuple(name for name in library if name not in names),
        confounded=confounded,
        notes=(*words, *case.notes),
        seed=seed,
        draws=drawn.share[..., 0].size,
        versions=versions(),
        data_sha256=case.data_sha256,
        each_gear=(*used, *unused),
        checks=checks,
        name=case.name,
    )


def _sampled(
    gain: np.ndarray, prior: np.ndarray, names: Sequence[str], seed: int
) -> tuple[Frequencies, dict[str, np.ndarray]]:
    """Return draws, more where chains mix slowly, and the draws that are checked."""
    rng, draws = np.random.default_rng(seed), _DRAWS
    counts = _COUNTS * prior / prior.sum()
    while True:
        drawn = sample_frequencies(gain, counts, rng, chains=_CHAINS, draws=draws)
        common = drawn.share.mean(axis=(0, 1)) >= RARE
        checked = {n: drawn.share[..., k] for k, n in enumerate(names) if common[k]}
        draws *= 2
        if draws > _MOST_DRAWS or have_mixed(checked):
            return drawn, checked


def _shared(
    names: list[str],
    drawn: Frequencies,
    sets: Sequence[tuple[str, ...]],
    gain: np.ndarray,
) -> tuple[SharedCause, ...]:
    """Return the causes over all gears, the most frequent first."""
    share, cause = (draws.reshape(-1, draws.shape[-1]) for draws in drawn[:2])
    return tuple(
        SharedCause(
            cause=names[k],
            gears_named=sum(causes == (names[k],) for causes in sets),
            gears=Interval.of(np.sum(cause == k, axis=1)),
            share=Interval.of(share[:, k]),
            log_evidence_nat=float(gain[:, k].sum()),
        )
        for k in np.argsort(-share.mean(axis=0), kind="stable").tolist()
    )


def _confounded(
    names: list[str], chance: np.ndarray, alone: np.ndarray
) -> tuple[str, ...]:
    """Return effects that single gears do not separate from something outside.

    Structure outside the library would be the same in all gears, so that many gears do
    not separate it from the effect either.
    """
    if OUTSIDE not in names:
        return ()
    log_alone = np.log(np.maximum(alone, np.finfo(float).tiny))
    odds = log_alone - log_alone[:, [names.index(OUTSIDE)]]
    likeliest = chance.argmax(axis=1)
    unclear = [
        k for k in set(likeliest) if odds[likeliest == k, k].mean() < _SUBSTANTIAL
    ]
    return tuple(names[k] for k in sorted(unclear) if names[k] not in (NONE, OUTSIDE))


def _credible_set(
    names: list[str], chance: np.ndarray, confounded: Sequence[str]
) -> tuple[str, ...]:
    """Return the fewest causes with the credible probability, most probable first."""
    order = np.argsort(-chance, kind="stable")
    many = 1 + int(np.sum(np.cumsum(chance[order]) < _CREDIBLE))
    causes = tuple(names[int(k)] for k in order[:many])
    add = causes[0] in confounded and OUTSIDE not in causes
    return (*causes, OUTSIDE) if add else causes
