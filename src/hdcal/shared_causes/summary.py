"""The result of many gears from draws of the frequencies of causes."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.case import Case
from hdcal.data.measurements.bad_gears import cause as fault
from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.data.theory_names import SPRING
from hdcal.evidence.table import OUTSIDE
from hdcal.inference.checks import Check
from hdcal.report.item import Interval
from hdcal.shared_causes.frequencies import Frequencies
from hdcal.shared_causes.gear_evidence import NONE
from hdcal.shared_causes.result import FleetCauses, GearCauses, LotCauses, SharedCause
from hdcal.versions import versions

# Probability of the set of causes of a gear.
_CREDIBLE = 0.9
# Log odds that are substantial (Jeffreys, Theory of Probability, 1961).
_SUBSTANTIAL = 0.5 * np.log(10.0)


def fleet_causes(
    *,
    case: Case,
    names: Sequence[str],
    drawn: Frequencies,
    alone: np.ndarray,
    gain: np.ndarray,
    checks: tuple[Check, ...],
    library: Sequence[str],
    seed: int,
) -> FleetCauses:
    """Return the result.

    Args:
        case: readings of all gears.
        names: of the causes.
        drawn: frequencies of causes, and the cause of each gear.
        alone: probability of each cause by the gear alone, shape (g, k).
        gain: log evidence of each cause over none, shape (g, k).
        checks: of the sampler.
        library: effects that were considered.
        seed: of the random numbers.
    """
    share = drawn.share.reshape(-1, len(names))
    cause = drawn.cause.reshape(len(share), -1)
    confounded = _confounded(names, drawn.chance, alone)
    sets = [_credible_set(names, row, confounded) for row in drawn.chance]
    reasons = tuple(c.words for c in checks if c.outcome == "failed")
    left_out = {gear: fault(why) for gear, why in case.left_out.items()}
    notes = case.notes
    if left_out:
        notes = (left_out_words(case.left_out, len(sets) + len(left_out)), *notes)
    return FleetCauses(
        part="part" if case.gear.theory == SPRING else "gear",
        units=case.units,
        reasons=reasons,
        gears=len(sets),
        rows=len(case.records.force),
        left_out=left_out,
        causes=tuple(
            SharedCause(
                cause=names[k],
                gears_named=sum(each == (names[k],) for each in sets),
                gears=Interval.of(np.sum(cause == k, axis=1)),
                share=Interval.of(share[:, k]),
                log_evidence_nat=float(gain[:, k].sum()),
            )
            for k in map(int, np.argsort(-share.mean(axis=0), kind="stable"))
        ),
        lots=_lots(case, cause != names.index(NONE)),
        not_shown=tuple(name for name in library if name not in names),
        confounded=confounded,
        notes=notes,
        seed=seed,
        draws=len(share),
        versions=versions(),
        data_sha256=case.data_sha256,
        each_gear=(
            *_rows(case, names, sets, drawn.chance, alone, failed=bool(reasons)),
            *(
                GearCauses(gear=g, status=f"left out: {why}")
                for g, why in left_out.items()
            ),
        ),
        checks=checks,
        name=case.name,
    )


def _confounded(
    names: Sequence[str], chance: np.ndarray, alone: np.ndarray
) -> tuple[str, ...]:
    """Return effects that gears alone do not separate from something outside."""
    if OUTSIDE not in names:
        return ()
    log_alone = np.log(np.maximum(alone, np.finfo(float).tiny))
    odds = log_alone - log_alone[:, [names.index(OUTSIDE)]]
    likeliest = chance.argmax(axis=1)
    return tuple(
        names[k]
        for k in map(int, np.unique(likeliest))
        if names[k] not in (NONE, OUTSIDE)
        and np.mean(odds[likeliest == k, k]) < _SUBSTANTIAL
    )


def _credible_set(
    names: Sequence[str], chance: np.ndarray, confounded: Sequence[str]
) -> tuple[str, ...]:
    """Return the fewest causes with the credible probability, the likeliest first."""
    order = np.argsort(-chance, kind="stable")
    many = 1 + int(np.sum(np.cumsum(chance[order]) < _CREDIBLE))
    found = tuple(names[int(k)] for k in order[:many])
    add = found[0] in confounded and OUTSIDE not in found
    return (*found, OUTSIDE) if add else found


def _lots(case: Case, something: np.ndarray) -> tuple[LotCauses, ...]:
    lots = np.array(case.lots)
    return tuple(
        LotCauses(
            lot=lot,
            gears=int(np.sum(lots == lot)),
            gears_with_effect=Interval.of(something[:, lots == lot].sum(axis=1)),
        )
        for lot in sorted({*case.lots})
    )


def _rows(
    case: Case,
    names: Sequence[str],
    sets: Sequence[tuple[str, ...]],
    chance: np.ndarray,
    alone: np.ndarray,
    *,
    failed: bool,
) -> list[GearCauses]:
    """Return a row for each gear."""
    rows = np.bincount(case.records.specimen)
    return [
        GearCauses(
            gear=gear,
            lot=case.lots[k] if case.lots else None,
            rows=int(rows[k]),
            causes=" / ".join(sets[k]),
            probability=float(chance[k].max()),
            probability_none=float(chance[k, names.index(NONE)]),
            alone=names[int(alone[k].argmax())],
            probability_alone=float(alone[k].max()),
            status="failed" if failed else "ok",
        )
        for k, gear in enumerate(case.specimen_labels)
    ]
