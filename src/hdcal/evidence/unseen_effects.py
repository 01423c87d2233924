"""Second effects that are too small to be seen: a pair of which one is, is none.

The prior of an amplitude reaches down to nothing, so that beside a true cause every
other effect keeps a share of the evidence, at sizes that no reading shows. A pair means
two effects that can be seen; as far as one cannot, the other acts alone.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from hdcal.evidence.case_evidence import (
    LEAST_SEEN,
    QUANTISATION,
    CaseEvidence,
    pair_name,
)
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.inner_products import (
    common_terms,
    piece_products,
    subspace_products,
)
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.prepare import PreparedCase, with_relative_noise
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.single_evidence import SingleEvidence, single_evidence

# An effect of less probability alone hardly stands in a pair of any.
_LEAST = 0.05


def with_unseen(
    evidence: CaseEvidence, probabilities: Mapping[str, float]
) -> CaseEvidence:
    """Return the evidence with how probably the second of each pair is not seen.

    Args:
        evidence: of every hypothesis.
        probabilities: of each; effects that are likely alone are looked at.
    """
    likely = [n for n in evidence.effects if probabilities[n] >= _LEAST]
    likely.sort(key=lambda name: -probabilities[name])
    found: dict[str, tuple[str, float]] = {}
    for name in likely:
        for other, chance in _unseen_beside(evidence, name).items():
            pair = pair_name(name, other)
            # Of two likely effects the likelier one is the first.
            if pair in evidence.table and other != name:
                found.setdefault(pair, (name, chance))
    return replace(evidence, unseen=found)


def _unseen_beside(evidence: CaseEvidence, name: str) -> dict[str, float]:
    """Return how probably each effect on the mean is not seen beside one."""
    case = _beside(evidence, name)
    rows = replace(case.rows, correlations=np.array([evidence.likeliest_correlation]))
    sigma, noise_sd = case.priors["sigma"], case.noise_sd
    single = single_evidence(rows, evidence.piecewise, sigma, tolerant=False)
    found = _unseen_pieces(evidence, rows, single, noise_sd)
    spaces = evidence.subspaces
    for other in evidence.subspace_effects:
        own = spaces.of(other)
        products = subspace_products(rows, spaces.columns[own])
        scale, weight = spaces.scale[own], spaces.log_weight[own]
        each = subspace_evidence(common_terms(rows), products, scale, weight, sigma)[0]
        squares = scale**2 * products.spread[0].sum(axis=-1, keepdims=True)
        unseen = squares < LEAST_SEEN * noise_sd**2
        found[other] = _share(each, unseen.astype(float))
    return found


def _beside(evidence: CaseEvidence, name: str) -> PreparedCase:
    """Return the case whose model holds an effect, on the mean or on the noise."""
    if name in evidence.noise:
        return with_relative_noise(evidence.prepared, evidence.noise[name].relative_sd)
    return beside_effects(evidence, [] if name == QUANTISATION else [name])


def _unseen_pieces(
    evidence: CaseEvidence, rows: LinearRows, single: SingleEvidence, noise_sd: float
) -> dict[str, float]:
    """Return how probably each effect in pieces is not seen in these rows."""
    if not single.names:
        return {}
    shapes = np.concatenate([each.shapes for each in evidence.piecewise])
    squares = piece_products(rows, np.zeros_like(shapes), shapes).uu[0]
    every, found = single.parts[0], {}
    for index, name in enumerate(single.names):
        part = every.of(index)
        cells, mean, sd = part.cells, part.mean[0], part.sd[0]
        length = np.sqrt(np.maximum(squares[cells.piece], 1e-300))
        most = np.sqrt(LEAST_SEEN) * noise_sd / length
        low, high = np.maximum(cells.low, -most), np.minimum(cells.high, most)
        inside = _mass(low, high, mean, sd) / np.maximum(
            _mass(cells.low, cells.high, mean, sd), 1e-300
        )
        found[name] = _share(part.log_evidence[0], np.clip(inside, 0.0, 1.0))
    return found


def _mass(low, high, mean, sd) -> Float[np.ndarray, " m"]:
    """Return the probability of an interval of a normal; none where it is empty."""
    low, high = (low - mean) / sd, (high - mean) / sd
    flip = low > 0.0
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    return np.where(high > low, ndtr(high) - ndtr(low), 0.0)


def _share(log_weight: np.ndarray, part: np.ndarray) -> float:
    """Return the mean of a part of each, weighed by evidence."""
    weight = np.exp(log_weight - np.max(log_weight))
    return float(np.sum(weight * part) / np.sum(weight))
