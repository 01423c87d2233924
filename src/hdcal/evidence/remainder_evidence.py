"""Effect plus remainder: a cause of the library, and something beside it that is none.

The effect at its most probable point joins the base model, its amplitude as good as
free and its shape loose; unknown structure is then looked for in what is left. What of
the gap the effect carries decides whether it is the cause, or only in the way.
"""

from collections.abc import Container, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hdcal.evidence.case_evidence import CaseEvidence, with_remainder
from hdcal.evidence.design_matrix import DesignMatrix, fit_design, join_designs
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.inner_products import common_terms
from hdcal.evidence.kernels import visible_kernels
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.local_structure import (
    DirectionFamily,
    direction_families,
    likeliest_directions,
)
from hdcal.evidence.prepare import PreparedCase, with_relative_noise
from hdcal.evidence.single_evidence import evidence_of_none
from hdcal.evidence.subspaces import WIDTH, SubspaceEvidence, evidence_of_subspaces
from hdcal.evidence.unknown_structure import unknown_evidence

# Effects beside which a remainder is looked for: the likeliest alone.
_MOST = 10
# The amplitude is as good as free: it may be this many times what was found.
_FREE = 3.0
_DRAWS = 200
# Correlations at which a remainder is weighed, always as many: the likeliest, which
# stand for the others.
_CORRELATIONS = 2


def with_remainders(evidence: CaseEvidence, rng: np.random.Generator) -> CaseEvidence:
    """Return the evidence with each likely effect and a remainder beside it too.

    Args:
        evidence: of each hypothesis without.
        rng: of the draws of shares.
    """
    if not evidence.kernel_names:
        return evidence
    table, closed, every = evidence.table, {}, {}
    families = direction_families(evidence.prepared.records)
    on_mean = [name for name in evidence.effects if name not in evidence.on_noise]
    on_mean.sort(key=lambda name: -np.logaddexp.reduce(table[name]))
    for name in on_mean[:_MOST]:
        beside = beside_effects(evidence, [name])
        gain, kernels, counts = _gain(evidence, beside, families)
        closed[name] = _shares(evidence, beside, kernels, counts, rng)
        every[with_remainder(name)] = table[name] + gain
    # An effect on the noise carries nothing of a gap in the mean.
    closed |= {name: np.zeros(_DRAWS) for name in evidence.on_noise}
    for name, effect in evidence.noise.items():
        case = with_relative_noise(evidence.prepared, effect.relative_sd)
        gain, _, _ = _gain(evidence, case, families)
        every[with_remainder(name)] = table[name] + gain
    return replace(evidence, table=table | every, closed=closed)


def _gain(
    evidence: CaseEvidence, case: PreparedCase, families: Sequence[DirectionFamily]
) -> tuple[np.ndarray, SubspaceEvidence, dict[str, float]]:
    """Return log evidence of unknown structure less that without, [correlation].

    And the kernels, with the log of the number that each was chosen from.

    Args:
        evidence: for the kernels that its rows can show.
        case: whose base model holds the effect beside which it is looked for.
        families: of local structure.
    """
    spaces, local = evidence.subspaces, likeliest_directions(case, families)
    every, weight = case.rows.correlations, evidence.weight_of_correlations
    likely = np.sort(np.argsort(-weight)[:_CORRELATIONS])
    case = replace(case, rows=replace(case.rows, correlations=every[likely]))
    counts = {name: count for name, _, count in local}
    kernels = {
        name: spaces.columns[spaces.of(name)[0]]
        for name in evidence.kernel_names
        if name not in counts
    }
    # Stretches and periods are chosen anew, by what is left beside the effect.
    tables = {n: t for n, t, _ in local if n in evidence.kernel_names}
    kernels |= zip(*visible_kernels(case.rows, tables, WIDTH), strict=True)
    found = evidence_of_subspaces(case, common_terms(case.rows), {}, kernels)
    none = evidence_of_none(case.rows, case.priors["sigma"])
    own = {name: counts.get(name, 0.0) for name in kernels}
    gain = np.full(len(every), -np.inf)
    gain[likely] = unknown_evidence(found, own, none) - none
    return gain - np.log(weight[likely].sum()), found, own


def beside_effects(evidence: CaseEvidence, names: Sequence[str]) -> PreparedCase:
    """Return the case whose base model also holds what effects may add.

    Each effect stands where most of its evidence is: else what is found beside it would
    be counted on top of what another shape of it explains.
    """
    prepared = evidence.prepared
    parts = [_added(evidence, name) for name in names]
    parts = [part for part in parts if part is not None]
    if not parts:
        return prepared
    rows = prepared.rows
    columns = np.concatenate([rows.base, *(columns.T for _, columns in parts)], axis=1)
    precision = np.full(columns.shape[1], prepared.noise_sd**2)
    precision[: rows.base.shape[1]] = rows.precision
    rest = replace(
        rows,
        reading=rows.reading - np.sum([offset for offset, _ in parts], axis=0),
        base=columns,
        precision=precision,
    )
    return replace(prepared, rows=rest)


def _added(evidence: CaseEvidence, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return offset and columns [N per prior sd] of an effect; noise has none."""
    rows = evidence.prepared.rows
    if name in evidence.single.names:
        effect = evidence.piecewise[evidence.single.names.index(name)]
        at = int(np.argmax(evidence.weight_of_correlations))
        piece, size, loose = evidence.single.likeliest(name, at)
        free = _FREE * size * effect.slopes[[piece]]
        shape = loose * remove_base(rows, effect.shapes[[piece]]) * rows.tolerance
        return effect.offsets[piece], np.concatenate([free, shape])
    if name not in evidence.subspace_effects:
        return None
    design = design_of(evidence, [name])
    noise, width = evidence.prepared.noise_sd, rows.base.shape[1]
    fit = fit_design(rows, design, noise, evidence.likeliest_correlation)
    size = np.maximum(np.abs(fit.mean[width:]), design.sd)
    return design.offset, _FREE * size[:, None] * design.columns


def _shares(
    evidence: CaseEvidence,
    beside: PreparedCase,
    kernels: SubspaceEvidence,
    log_counts: dict[str, float],
    rng: np.random.Generator,
) -> np.ndarray:
    """Return draws of the share of the visible gap that an effect closes, (d,).

    Effect and remainder are fitted together, the remainder along its likeliest kernel.
    """
    own, rows = evidence.prepared, beside.rows
    whole = np.logaddexp.reduce(kernels.log_evidence, axis=(0, 2))
    whole -= np.array([log_counts[name] for name in kernels.names])
    best = kernels.names[int(np.argmax(whole))]
    columns = kernels.columns[kernels.of(best)[0]]
    columns = columns[np.any(columns != 0.0, axis=1)]
    count = len(columns)
    scale = np.full(count, kernels.likeliest(best)[1])
    nothing = np.zeros(len(rows.reading))
    design = DesignMatrix(nothing, columns, np.zeros(count), scale, {})
    fit = fit_design(rows, design, own.noise_sd, evidence.likeliest_correlation)
    draws = rng.multivariate_normal(
        fit.mean, fit.covariance, _DRAWS, check_valid="ignore", method="eigh"
    )
    width, ends = own.rows.base.shape[1], rows.base.shape[1]
    offset = own.rows.reading - rows.reading
    effect = offset + draws[:, width:ends] @ rows.base[:, width:].T
    rest = draws[:, ends:] @ columns
    effect, rest = remove_base(own.rows, effect), remove_base(own.rows, rest)
    left, gap = (np.sqrt(np.mean(part**2, axis=1)) for part in (rest, effect + rest))
    return np.clip(1.0 - left / np.maximum(gap, 1e-300), 0.0, 1.0)


def closed_by(
    evidence: CaseEvidence, hypothesis: Sequence[str], effects: Container[str]
) -> float:
    """Return the share of a hypothesis' visible gap that some of its effects close.

    1 where it moves the mean nowhere.

    Args:
        evidence: of the case.
        hypothesis: its effects; what is on the noise or unknown adds nothing.
        effects: which of them.
    """
    prepared = evidence.prepared
    known = {*evidence.single.names, *evidence.subspace_effects}
    names = [name for name in hypothesis if name in known]
    parts = [design_of(evidence, [name]) for name in names]
    rows, count = prepared.rows, len(prepared.rows.reading)
    joined = join_designs(parts, count)
    fit = fit_design(rows, joined, prepared.noise_sd, evidence.likeliest_correlation)
    ends = np.cumsum([rows.base.shape[1]] + [len(part.columns) for part in parts])
    curves = [
        part.offset + part.columns.T @ fit.mean[start:end]
        for part, (start, end) in zip(parts, pairwise(ends), strict=True)
    ]
    rest = [c for name, c in zip(names, curves, strict=True) if name not in effects]
    nothing = np.zeros(count)
    left, whole = remove_base(
        rows, np.stack([sum(rest, nothing), sum(curves, nothing)])
    )
    size = np.linalg.norm(whole)
    return 1.0 if size == 0.0 else float(1.0 - np.linalg.norm(left) / size)
