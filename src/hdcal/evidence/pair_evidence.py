"""Evidence of every pair of hypotheses, each kind in its own way."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from hdcal.evidence.case_evidence import (
    NONE,
    QUANTISATION,
    UNKNOWN,
    CaseEvidence,
    pair_name,
    with_remainder,
)
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.hypothesis_design import fitted_curve
from hdcal.evidence.inner_products import subspace_products
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.noise_evidence import NoiseEvidence, noise_evidence
from hdcal.evidence.piecewise_pairs import piecewise_pair_evidence
from hdcal.evidence.single_evidence import SingleEvidence, single_evidence
from hdcal.evidence.subspaces import mean_evidence
from hdcal.physics.effect import Effect

# Effects beside which the shape of the noise is looked at anew.
_BESIDE = 2


def pair_evidence(
    evidence: CaseEvidence, noisy: Mapping[str, type[Effect]]
) -> dict[str, np.ndarray]:
    """Return the log evidence of every pair, [correlation].

    Args:
        evidence: of each hypothesis alone.
        noisy: effects on the noise by name.
    """
    table = evidence.table
    mean = [*evidence.single.names, *evidence.subspace_effects]
    # Begun first, read last: XLA goes on meanwhile.
    beside = _noise_beside_best(evidence, noisy, mean)
    pairs = _piecewise_pairs(evidence)
    for name in evidence.subspace_effects:
        pairs |= _pairs_with_subspace(evidence, name)
    pairs |= _noise_pairs(evidence, beside, mean)
    if QUANTISATION in table:
        # Rounding gains as much beside any effect as it does alone.
        gain = table[QUANTISATION] - table[NONE]
        others = [*mean, *evidence.noise]
        pairs |= {pair_name(QUANTISATION, n): table[n] + gain for n in others}
        pairs[with_remainder(QUANTISATION)] = table[UNKNOWN] + gain
    return pairs


def _piecewise_pairs(evidence: CaseEvidence) -> dict[str, np.ndarray]:
    """Return pairs of effects with one amplitude each."""
    if len(evidence.piecewise) < 2:
        return {}
    pairs: dict[str, np.ndarray] = {}
    for index in evidence.likely_correlations:
        both = piecewise_pair_evidence(
            evidence.prepared.rows,
            evidence.single,
            evidence.piecewise,
            evidence.prepared.priors["sigma"],
            int(index),
        )
        for names, value in both.items():
            impossible = np.full_like(evidence.table[NONE], -np.inf)
            pairs.setdefault(pair_name(*names), impossible)[index] = value
    return pairs


def _pairs_with_subspace(evidence: CaseEvidence, name: str) -> dict[str, np.ndarray]:
    """Return pairs of one subspace with single effects and with subspaces after it."""
    sigma = evidence.prepared.priors["sigma"]
    rows = _with_subspace(evidence, name)
    beside = single_evidence(rows, evidence.piecewise, sigma, tolerant=False)
    alone = evidence.table[name]
    pairs = {
        other: alone + (mean_evidence(found) - beside.none)
        for other, found in _later_subspaces(evidence, rows, beside, name).items()
    }
    pairs |= {n: alone + (beside.by_correlation(n) - beside.none) for n in beside.names}
    return {pair_name(name, other): value for other, value in pairs.items()}


def _later_subspaces(
    evidence: CaseEvidence, rows: LinearRows, beside: SingleEvidence, name: str
) -> dict[str, np.ndarray]:
    """Return evidences of the subspaces after one beside it, [correlation, b, t]."""
    later = [other for other in evidence.subspace_effects if other > name]
    if not later:
        return {}
    spaces = evidence.subspaces
    own = np.concatenate([spaces.of(other) for other in later])
    found = subspace_evidence(
        beside.common,
        subspace_products(rows, spaces.columns[own]),
        spaces.scale[own],
        spaces.log_weight[own],
        evidence.prepared.priors["sigma"],
    )
    label = np.asarray(spaces.names)[own]
    return {other: found[:, label == other] for other in later}


def _with_subspace(evidence: CaseEvidence, name: str) -> LinearRows:
    """Return rows whose base also absorbs an effect at its most probable scale."""
    spaces, rows = evidence.subspaces, evidence.prepared.rows
    shape, scale = spaces.likeliest(name)
    columns = scale * spaces.columns[spaces.of(name)[shape]].T
    noise = np.full(columns.shape[1], evidence.prepared.noise_sd**2)
    return replace(
        rows,
        base=np.concatenate([rows.base, columns], axis=1),
        precision=np.concatenate([rows.precision, noise]),
    )


def _noise_beside_best(
    evidence: CaseEvidence, noisy: Mapping[str, type[Effect]], mean: list[str]
) -> dict[str, dict[str, NoiseEvidence]]:
    """Return the evidence of each effect on the noise beside each of the likeliest."""
    whole = {name: np.logaddexp.reduce(evidence.table[name]) for name in mean}
    best = sorted(mean, key=lambda name: -whole[name])[:_BESIDE]
    curves = {name: fitted_curve(evidence, name) for name in best}
    return {
        name: {
            other: noise_evidence(noisy[name], evidence.prepared, curve)
            for other, curve in curves.items()
        }
        for name in evidence.noise
    }


def _noise_pairs(
    evidence: CaseEvidence,
    beside: Mapping[str, Mapping[str, NoiseEvidence]],
    mean: list[str],
) -> dict[str, np.ndarray]:
    """Return pairs of an effect on the noise with any other.

    Noise takes up what structure the mean has left, so that its evidence is found
    anew beside each of the likeliest effects; beside others the least of these counts.
    """
    table, noise, pairs = evidence.table, evidence.noise, {}
    for name, alone in noise.items():
        factor = {other: found.log_factor for other, found in beside[name].items()}
        least = min([alone.log_factor, *factor.values()])
        for other in mean:
            gain = factor.get(other, least)
            pairs[pair_name(name, other)] = table[other] + gain
    for one, two in combinations(noise, 2):
        least = min(noise[one].log_factor, noise[two].log_factor)
        better = np.maximum(table[one], table[two])
        # They compete for the same rows: no more than the better one of them.
        pairs[pair_name(one, two)] = better + min(least, 0.0)
    return pairs
