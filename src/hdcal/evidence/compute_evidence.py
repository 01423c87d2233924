"""All hypotheses of one case side by side: none, effects, pairs, unknown."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.evidence.case_evidence import (
    LEAST_SEEN,
    NONE,
    QUANTISATION,
    UNKNOWN,
    CaseEvidence,
)
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.noise_evidence import NoiseEvidence, noise_evidence
from hdcal.evidence.pair_evidence import pair_evidence
from hdcal.evidence.parameter_grid import SCALES
from hdcal.evidence.piecewise_effect import PiecewiseEffect, piecewise_effect
from hdcal.evidence.prepare import PreparedCase, prepare, with_relative_noise
from hdcal.evidence.quantisation import quantisation_evidence
from hdcal.evidence.single_evidence import evidence_of_none, single_evidence
from hdcal.evidence.subspaces import (
    SubspaceEffect,
    evidence_of_subspaces,
    is_subspace,
    subspace_effect,
)
from hdcal.evidence.unknown_structure import unknown_evidence, unknown_kernels
from hdcal.inference.problem import problem_priors
from hdcal.physics.effect import Effect

Library = Mapping[str, type[Effect]]


def compute_evidence(
    case: Case,
    library: Library,
    shipped: Mapping[str, Prior],
    *,
    noise_sd: float | None = None,
    stiffness: float | None = None,
) -> CaseEvidence:
    """Compute the evidence of every hypothesis.

    Args:
        case: gear and records.
        library: effects to consider.
        shipped: priors of every effect in the library.
        noise_sd: of a reading [N]; by default a pilot estimate.
        stiffness: about which effects act [N/mm]; by default from least squares.

    Raises:
        InputError: an effect has no prior.
    """
    # Raises where a prior is missing.
    problem_priors(case, tuple(library.values()), shipped, case.gear.theory)
    prepared = prepare(case, shipped, noise_sd, stiffness)
    missing = {n: effect.needs - case.records.known for n, effect in library.items()}
    accounted = (QUANTISATION,) if case.gear.force_resolution > 0.0 else ()
    testable = [n for n in library if not missing[n] and n not in accounted]
    noisy = {n: library[n] for n in testable if library[n].stage == "noise"}
    piecewise, subspaces = [], {}
    for name in [name for name in testable if name not in noisy]:
        effect = library[name]
        if is_subspace(effect, prepared):
            subspaces[name] = subspace_effect(effect, prepared)
        else:
            piecewise.append(piecewise_effect(effect, prepared))
    evidence = _without_pairs(prepared, tuple(piecewise), subspaces, noisy)
    every = evidence.table | pair_evidence(evidence, noisy)
    curves = {each.name: each.large[:, None] for each in piecewise}
    curves |= {name: each.large * each.columns for name, each in subspaces.items()}
    # All are computed, so that the same executables serve every case; effects that
    # its rows cannot show do not compete.
    hidden = [n for n in testable if n in curves and not _seen(prepared, curves[n])]
    return replace(
        evidence,
        table={n: v for n, v in every.items() if not {*hidden} & {*n.split("+")}},
        not_testable={n: tuple(sorted(m)) for n, m in missing.items() if m},
        not_excited=tuple(hidden),
        accounted=accounted,
    )


def _without_pairs(
    prepared: PreparedCase,
    piecewise: tuple[PiecewiseEffect, ...],
    effects: dict[str, SubspaceEffect],
    noisy: Library,
) -> CaseEvidence:
    """Return the evidence of none, of each effect alone and of unknown structure."""
    noise = {
        n: noise_evidence(e, prepared) for n, e in noisy.items() if n != QUANTISATION
    }
    single = single_evidence(prepared.rows, piecewise, prepared.priors["sigma"])
    kernels, log_counts = unknown_kernels(prepared, piecewise, effects.values())
    subspaces = evidence_of_subspaces(prepared, single.common, effects, kernels)
    table = {NONE: single.none}
    table |= {name: single.by_correlation(name) for name in single.names}
    table |= {name: subspaces.by_correlation(name) for name in effects}
    table[UNKNOWN] = unknown_evidence(subspaces, log_counts, single.none)
    table |= _noise_table(prepared, noise, single.none)
    step = 0.0
    if QUANTISATION in noisy:
        gain, step = quantisation_evidence(prepared)
        if np.isfinite(gain):
            table[QUANTISATION] = single.none + gain
    return CaseEvidence(
        prepared=prepared,
        piecewise=piecewise,
        single=single,
        subspaces=subspaces,
        subspace_effects=tuple(effects),
        kernel_names=tuple(kernels),
        noise=noise,
        rounding_step=step,
        table=table,
        scatter=tuple(name for name, effect in effects.items() if effect.scatter),
    )


def _noise_table(
    prepared: PreparedCase, noise: Mapping[str, NoiseEvidence], none: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the log evidence of each effect on the noise, [correlation]."""
    table = {}
    for name, found in noise.items():
        # What serial correlation adds is found with the rows weighted by their noise.
        rows = with_relative_noise(prepared, found.relative_sd).rows
        other = evidence_of_none(rows, prepared.priors["sigma"])
        table[name] = found.log_factor + none[0] + other - other[0]
    return table


def _seen(prepared: PreparedCase, curves: np.ndarray) -> bool:
    """Tell whether one of the shapes (s, j, n) of an effect can leave enough.

    At the widest of its priors, which is as large as a rig may have it.
    """
    flat = SCALES[-1] * curves.reshape(-1, curves.shape[-1])
    left = remove_base(prepared.rows, flat) * prepared.rows.weight
    squares = np.sum(left.reshape(curves.shape) ** 2, axis=(1, 2))
    return bool(np.max(squares) >= LEAST_SEEN * prepared.noise_sd**2)
