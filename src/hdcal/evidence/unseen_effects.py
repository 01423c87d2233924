"""Second effects that are too small to be seen: a pair of which one is, is none.

The prior of an amplitude reaches down to nothing, so that beside a true cause every
other effect on the mean keeps a share of the evidence, at sizes that no reading shows.
A pair means two effects that can be seen; as far as one cannot, the other acts alone.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.special import gammainc

from hdcal.evidence.case_evidence import (
    LEAST_SEEN,
    QUANTISATION,
    CaseEvidence,
    pair_name,
)
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.inner_products import piece_products, subspace_products
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.prepare import PreparedCase, with_relative_noise
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.single_evidence import SingleEvidence, single_evidence
from hdcal.inference.likelihood import log_interval

# Effects that are less probable hardly stand in a pair that is; the likeliest of them
# are enough.
_LEAST, _MOST = 0.05, 4


def with_unseen(
    evidence: CaseEvidence,
    inclusion: Mapping[str, float],
) -> CaseEvidence:
    """Return the evidence with how probably one of each pair is not seen.

    Of two effects that each could act alone, either may be the one that is not seen
    beside the other: as often as the other is likelier than this one.

    Args:
        evidence: of every hypothesis.
        inclusion: of each effect in all hypotheses; likely ones are looked at.
    """
    likely = sorted(inclusion, key=lambda name: -inclusion[name])[:_MOST]
    likely = [name for name in likely if inclusion[name] >= _LEAST]
    hidden = {name: _unseen_beside(evidence, name) for name in likely}
    found: dict[str, dict[str, float]] = {}
    for first in likely:
        for second, chance in hidden[first].items():
            pair = pair_name(first, second)
            if second == first or pair not in evidence.table:
                continue
            rival = inclusion[second] if first in hidden.get(second, {}) else 0.0
            share = inclusion[first] / (inclusion[first] + rival)
            found.setdefault(pair, {})[first] = share * chance
    return replace(evidence, unseen=found)


def _unseen_beside(evidence: CaseEvidence, name: str) -> dict[str, float]:
    """Return how probably each effect on the mean is not seen beside one."""
    case = _beside(evidence, name)
    rows = replace(case.rows, correlations=np.array([evidence.likeliest_correlation]))
    sigma, least = case.priors["sigma"], LEAST_SEEN * case.noise_sd**2
    single = single_evidence(rows, evidence.piecewise, sigma, tolerant=False)
    found = _unseen_pieces(evidence, rows, single, least)
    spaces = evidence.subspaces
    for other in evidence.subspace_effects:
        own = spaces.of(other)
        products = subspace_products(rows, spaces.columns[own])
        scale, weight = spaces.scale[own], spaces.log_weight[own]
        each = subspace_evidence(single.common, products, scale, weight, sigma)[0]
        spread, pull = products.spread[0][:, None], products.be[0][:, None]
        inside = _small(spread, pull, scale[..., None] ** 2, case.noise_sd**2, least)
        found[other] = _share(each, inside)
    return found


def _beside(evidence: CaseEvidence, name: str) -> PreparedCase:
    """Return the case whose model holds an effect, on the mean or on the noise."""
    if name in evidence.noise:
        return with_relative_noise(evidence.prepared, evidence.noise[name].relative_sd)
    return beside_effects(evidence, [] if name == QUANTISATION else [name])


def _unseen_pieces(
    evidence: CaseEvidence, rows: LinearRows, single: SingleEvidence, least: float
) -> dict[str, float]:
    """Return how probably each effect in pieces leaves less than this square [N²]."""
    if not single.names:
        return {}
    shapes = np.concatenate([each.shapes for each in evidence.piecewise])
    squares = piece_products(rows, np.zeros_like(shapes), shapes).uu[0]
    every, found = single.parts[0], {}
    for index, name in enumerate(single.names):
        part = every.of(index)
        cells, mean, sd = part.cells, part.mean[0], part.sd[0]
        most = np.sqrt(least / np.maximum(squares[cells.piece], 1e-300))
        low, high = np.maximum(cells.low, -most), np.minimum(cells.high, most)
        some = high > low
        ends = np.stack([low, np.where(some, high, cells.high), cells.low, cells.high])
        scaled = (ends - mean) / sd
        # What is no interval comes to nothing below.
        with np.errstate(all="ignore"):
            within, whole = log_interval(*scaled[:2]), log_interval(*scaled[2:])
            gained = within - whole
        inside = np.where(some, np.exp(np.minimum(gained, 0.0)), 0.0)
        found[name] = _share(part.log_evidence[0], np.nan_to_num(inside))
    return found


def _small(spread, pull, variance, noise: float, least: float):
    """Return the probability that a subspace leaves less than this square [N²].

    Along each principal axis its size is normal; the sum of squares has the mean and
    the variance of a gamma law, which stands for it.

    Args:
        spread: squared lengths of the axes, shape (b, 1, j).
        pull: products of the axes, at their lengths, with the reading.
        variance: of the prior along each, shape (b, t, 1).
        noise: variance of the noise [N²].
        least: the square [N²].
    """
    whole = noise + variance * spread
    centre, own = variance * pull / whole, variance * noise / whole
    mean = np.sum(spread * (centre**2 + own), axis=-1)
    squared = 2.0 * np.sum(spread**2 * (own**2 + 2.0 * own * centre**2), axis=-1)
    mean, squared = np.maximum(mean, 1e-300), np.maximum(squared, 1e-300)
    return gammainc(mean**2 / squared, least * mean / squared)


def _share(log_weight: Float[np.ndarray, "*m"], part: Float[np.ndarray, "*m"]) -> float:
    """Return the mean of a part of each, weighed by evidence."""
    weight = np.exp(log_weight - np.max(log_weight))
    return float(np.sum(weight * part) / np.sum(weight))
