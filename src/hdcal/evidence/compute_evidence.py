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
from hdcal.evidence.inner_products import CommonTerms
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.noise_evidence import NoiseEvidence, noise_evidence
from hdcal.evidence.pair_evidence import pair_evidence
from hdcal.evidence.piecewise_effect import PiecewiseEffect, piecewise_effect
from hdcal.evidence.prepare import PreparedCase, prepare, with_relative_noise
from hdcal.evidence.quantisation import quantisation_evidence
from hdcal.evidence.single_evidence import evidence_of_none, single_evidence
from hdcal.evidence.subspaces import (
    SubspaceEvidence,
    effect_columns,
    effect_scales,
    evidence_of_subspaces,
    is_subspace,
    large_scale,
    unknown_scales,
)
from hdcal.evidence.unknown_structure import mean_over_kernels, unknown_kernels
from hdcal.inference.problem import problem_priors
from hdcal.physics.effect import Effect
from hdcal.physics.scatter import Scatter


def compute_evidence(
    case: Case,
    library: Mapping[str, type[Effect]],
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
    known = case.records.known
    missing = {name: effect.needs - known for name, effect in library.items()}
    accounted = (QUANTISATION,) if case.gear.force_resolution > 0.0 else ()
    testable = {
        n: e for n, e in library.items() if not missing[n] and n not in accounted
    }
    noisy = {n: e for n, e in testable.items() if e.stage == "noise"}
    mean = {n: e for n, e in testable.items() if n not in noisy}
    several = {n: e for n, e in mean.items() if is_subspace(e, prepared)}
    columns = {n: effect_columns(e, prepared) for n, e in several.items()}
    piecewise = tuple(
        piecewise_effect(e, prepared) for n, e in mean.items() if n not in several
    )
    evidence = _evidence_without_pairs(prepared, piecewise, columns, several, noisy)
    every = evidence.table | pair_evidence(evidence, noisy)
    large = {each.name: each.large[:, None] for each in piecewise}
    large |= {n: large_scale(e, prepared) * columns[n] for n, e in several.items()}
    # All are computed, so that the same executables serve every noise; effects that
    # the rows cannot show do not compete.
    hidden = tuple(name for name in mean if not _seen(prepared, large[name]))
    return replace(
        evidence,
        table={n: v for n, v in every.items() if not {*hidden} & {*n.split("+")}},
        not_testable={n: tuple(sorted(m)) for n, m in missing.items() if m},
        not_excited=hidden,
        accounted=accounted,
    )


def _evidence_without_pairs(
    prepared: PreparedCase,
    piecewise: tuple[PiecewiseEffect, ...],
    columns: dict[str, np.ndarray],
    several: Mapping[str, type[Effect]],
    noisy: Mapping[str, type[Effect]],
) -> CaseEvidence:
    """Return the evidence of none, of each effect alone and of unknown structure."""
    sigma = prepared.priors["sigma"]
    single = single_evidence(prepared.rows, piecewise, sigma)
    kernels = unknown_kernels(prepared, piecewise, columns)
    subspaces = _subspaces(prepared, single.common, several, columns, kernels)
    table = {NONE: single.none}
    table |= {name: single.by_correlation(name) for name in single.names}
    table |= {name: subspaces.by_correlation(name) for name in columns}
    table[UNKNOWN] = mean_over_kernels(
        [
            subspaces.by_correlation(n) - log_count
            for n, (_, log_count) in kernels.items()
        ],
        single.none,
    )
    noise = {
        n: noise_evidence(e, prepared) for n, e in noisy.items() if n != QUANTISATION
    }
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
        subspace_effects=tuple(several),
        kernel_names=tuple(kernels),
        noise=noise,
        rounding_step=step,
        table=table,
        not_testable={},
        not_excited=(),
        accounted=(),
        scatter=tuple(n for n, e in several.items() if issubclass(e, Scatter)),
    )


def _subspaces(
    prepared: PreparedCase, common: CommonTerms, several, columns, kernels
) -> SubspaceEvidence:
    """Return the evidence of effects with several columns, and of kernels."""
    names, tables, scales = [], [], []
    for name, effect in several.items():
        names += [name] * len(columns[name])
        tables += list(columns[name])
        scales += [effect_scales(effect, prepared)] * len(columns[name])
    names += list(kernels)
    tables += [kernel for kernel, _ in kernels.values()]
    scales += [unknown_scales(prepared.priors["gap_sd"])] * len(kernels)
    sigma = prepared.priors["sigma"]
    return evidence_of_subspaces(
        prepared.rows, common, sigma, tuple(names), tables, scales
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
    """Tell whether one of the shapes (s, j, n) of a large effect leaves enough."""
    flat = curves.reshape(-1, curves.shape[-1])
    left = remove_base(prepared.rows, flat) * prepared.rows.weight
    squares = np.sum(left.reshape(curves.shape) ** 2, axis=(1, 2))
    return bool(np.max(squares) >= LEAST_SEEN * prepared.noise_sd**2)
