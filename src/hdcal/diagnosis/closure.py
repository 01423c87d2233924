"""How far the gap closes: a ladder of models from the nominal one to the noise."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.diagnosis.closed_share import (
    closed_share,
    extrapolated_share,
    placebo_share,
)
from hdcal.diagnosis.verdict import Closure, LadderEntry
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.design_matrix import DesignMatrix, fit_design, join_designs
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.smooth_gap import (
    DETECTED,
    REMAINDER,
    AdditiveBasis,
    SmoothGap,
    fit_smooth_gap,
)
from hdcal.report.intervals import credible_interval

# Sds of its own error by which a remainder must lower the noise variance to count.
_VISIBLE = 1.64


def closure(
    evidence: CaseEvidence,
    names: Sequence[str],
    members: Sequence[str],
    basis: AdditiveBasis,
    correlation: float,
    rng: np.random.Generator,
) -> Closure:
    """Return the ladder and the closed share for the named effects.

    Args:
        evidence: of the hypotheses.
        names: effects that are added together; empty when none was named.
        members: of the set, each compared alone.
        basis: of the smooth remainder.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.
    """
    design = design_of(evidence, names)
    ladder, after = _ladder(evidence, names, design, basis, correlation, rng)
    if not names:
        reason = "no effect of the library is named, so that none can be added"
    elif not len(design.columns):
        reason = f"{' and '.join(names)} changes the noise, not the mean reading"
    else:
        reason = ""
    if reason:
        return Closure(
            ladder, None, "", None, None, credible_interval(after.rms), reason
        )
    closed, held_out = closed_share(evidence, names, after, correlation, rng)
    noise = after.noise_sd
    return Closure(
        ladder=ladder,
        closed=closed,
        held_out=held_out,
        extrapolated_closed=extrapolated_share(evidence, names, noise, correlation),
        placebo_closed=placebo_share(evidence, len(design.columns), noise, correlation),
        remainder_N=credible_interval(after.rms),
        reason="" if closed else "no block shows a gap beyond the noise",
        bars=_closed_by_member(evidence, members, after, correlation, rng),
    )


def _ladder(
    evidence: CaseEvidence,
    names: Sequence[str],
    design: DesignMatrix,
    basis: AdditiveBasis,
    correlation: float,
    rng: np.random.Generator,
) -> tuple[tuple[LadderEntry, ...], SmoothGap]:
    """Return the error of each model, and the smooth remainder beside the effects."""
    prepared, rows = evidence.prepared, evidence.prepared.rows
    empty = join_designs([], len(rows.reading))
    base = fit_design(rows, empty, prepared.noise_sd, correlation)
    full = fit_design(rows, design, prepared.noise_sd, correlation)
    rest = rows.reading - full.contribution(rows.base.shape[1])
    floor = REMAINDER if names else DETECTED
    after = fit_smooth_gap(prepared, basis, correlation, rng, rest, floor)
    left = rows.reading - full.predict()
    after = _without_needless(after, left * rows.weight, 3 + len(design.columns))
    ladder = [
        LadderEntry("nominal", _rms(_nominal_residual(evidence))),
        LadderEntry("calibrated", _rms(rows.reading - base.predict())),
    ]
    if names:
        ladder.append(LadderEntry("calibrated+" + "+".join(names), _rms(left)))
    last = "calibrated+" + "+".join([*names, "remainder"])
    ladder.append(LadderEntry(last, _rms(left - after.mean)))
    ladder.append(LadderEntry("noise", after.noise_sd))
    return tuple(ladder), after


def _without_needless(after: SmoothGap, left: np.ndarray, used: int) -> SmoothGap:
    """Return the noise beside the effects alone where no remainder is to be seen.

    A smooth remainder always takes a little noise along, and the closed share is the
    root of a small difference: it would come out too low.
    """
    size = len(left)
    alone = np.sum(left**2) / max(size - used, 1)
    if alone - after.noise_sd**2 > _VISIBLE * np.sqrt(2.0 / size) * alone:
        return after
    ratio = alone / after.noise_sd**2
    return replace(
        after, noise_sd=float(np.sqrt(alone)), variance=after.variance * ratio
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _nominal_residual(evidence: CaseEvidence) -> np.ndarray:
    """Return readings minus the formula itself: K = 1, no offset."""
    prepared = evidence.prepared
    records, reading = prepared.records, prepared.reading
    rise = np.asarray(records.temperature) - reading.reference_temperature
    radial = np.asarray(records.deformation) * reading.radial_per_read
    modulus = 1.0 - prepared.base.alpha * rise
    return np.asarray(records.force) - prepared.nominal * modulus * radial


def _closed_by_member(evidence, members, after, correlation, rng) -> dict[str, float]:
    """Return the closed share of each member alone, where there is one."""
    shares = {}
    for name in members:
        closed, _ = closed_share(evidence, [name], after, correlation, rng)
        if closed is not None:
            shares[name] = closed.median
    return shares
