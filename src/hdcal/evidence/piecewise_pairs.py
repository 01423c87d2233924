"""Evidence of two effects in pieces at once: a bivariate normal in a box."""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.priors import Prior
from hdcal.data.records import Array
from hdcal.evidence.closed_form import (
    LOG_2PI,
    TINY,
    AmplitudeCells,
    integrate_noise,
    most_probable_noise,
    pad_axis,
)
from hdcal.evidence.inner_products import gram_matrix
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.piecewise_effect import PiecewiseEffect
from hdcal.evidence.single_evidence import SingleEvidence
from hdcal.exported import jit
from hdcal.inference.likelihood import log_interval

# Cells of each effect that take part: the most probable ones alone, and some across
# its prior for what only shows beside another effect.
_BEST, _SPREAD = 4, 2


class CellPairs(NamedTuple):
    """Pairs of amplitude cells, one entry for each; inner products after projection.

    Attributes:
        ee: squared length of the reading less both offsets.
        eu: products with both slopes, [2, m].
        uu: Gram entries (11, 12, 22) of the slopes, [3, m].
        low: lower ends of the amplitudes, [2, m].
        high: upper ends, [2, m].
        mean: of the priors, [2, m].
        precision: of the priors, [2, m].
        log_height: sum of both.
    """

    ee: Float[Array, " m"]
    eu: Float[Array, "2 m"]
    uu: Float[Array, "3 m"]
    low: Float[Array, "2 m"]
    high: Float[Array, "2 m"]
    mean: Float[Array, "2 m"]
    precision: Float[Array, "2 m"]
    log_height: Float[Array, " m"]


def _log_box(pairs: CellPairs, mean, cov11, cov12, cov22):
    """Return log P(box) of a bivariate normal, the second given the first's moments."""
    sd1 = jnp.sqrt(cov11)
    low, high = (pairs.low[0] - mean[0]) / sd1, (pairs.high[0] - mean[0]) / sd1
    first = log_interval(low, high)
    # Moments of the cut normal, from its density at both ends.
    ends = jnp.stack([low, high])
    density = jnp.exp(-0.5 * ends**2 - 0.5 * LOG_2PI - first)
    shift = density[0] - density[1]
    finite = jnp.where(jnp.abs(ends) < 30.0, ends, 0.0)
    spread = 1.0 + finite[0] * density[0] - finite[1] * density[1] - shift**2
    shift = jnp.clip(shift, jnp.minimum(low, high), jnp.maximum(low, high))
    spread = jnp.clip(spread, 1e-6, 1.0)
    slope = cov12 / sd1
    centre = mean[1] + slope * shift
    sd2 = jnp.sqrt(jnp.maximum(cov22 - slope**2 * (1.0 - spread), 1e-12 * cov22))
    second = log_interval((pairs.low[1] - centre) / sd2, (pairs.high[1] - centre) / sd2)
    return first + second


def _amplitudes(pairs: CellPairs, log_sd):
    """Return determinant of the precision, pull, mean and covariance of both."""
    variance = jnp.exp(2.0 * log_sd)
    p11 = pairs.uu[0] / variance + pairs.precision[0] + TINY
    p12 = pairs.uu[1] / variance
    p22 = pairs.uu[2] / variance + pairs.precision[1] + TINY
    drawn = pairs.eu / variance + pairs.precision * pairs.mean
    det = jnp.maximum(p11 * p22 - p12**2, 1e-12 * p11 * p22)
    cov11, cov12, cov22 = p22 / det, -p12 / det, p11 / det
    mean = jnp.stack(
        [cov11 * drawn[0] + cov12 * drawn[1], cov12 * drawn[0] + cov22 * drawn[1]]
    )
    return det, drawn, mean, (cov11, cov12, cov22)


@jit
def _cell_pair_evidence(constant, rows, pairs: CellPairs, sigma: Prior):
    def step(log_sd):
        mean = jnp.clip(_amplitudes(pairs, log_sd)[2], pairs.low, pairs.high)
        left = (
            pairs.ee
            - 2.0 * jnp.sum(mean * pairs.eu, axis=0)
            + mean[0] ** 2 * pairs.uu[0]
            + 2.0 * mean[0] * mean[1] * pairs.uu[1]
            + mean[1] ** 2 * pairs.uu[2]
        )
        return 0.5 * jnp.log(jnp.maximum(left, 1e-9 * pairs.ee) / rows)

    log_sd = most_probable_noise(step, 0.5 * jnp.log(pairs.ee / rows))

    def value(at):
        det, drawn, mean, cov = _amplitudes(pairs, at)
        return (
            -rows * at
            - 0.5 * pairs.ee * jnp.exp(-2.0 * at)
            + 0.5 * jnp.sum(drawn * mean, axis=0)
            - 0.5 * jnp.sum(pairs.precision * pairs.mean**2, axis=0)
            + LOG_2PI
            - 0.5 * jnp.log(det)
            + _log_box(pairs, mean, *cov)
            + pairs.log_height
        )

    total = integrate_noise(value, log_sd, rows, sigma)
    return total + constant - 0.5 * rows * LOG_2PI


def cell_pair_evidence(
    constant: float, rows: float, pairs: CellPairs, sigma: Prior
) -> Float[np.ndarray, " m"]:
    """Return the log evidence of pairs of cells.

    Args:
        constant: log of the determinants of whitening and base model.
        rows: number of rows.
        pairs: inner products and cells.
        sigma: prior of the noise sd.
    """
    found = _cell_pair_evidence(constant, rows, pad_axis(pairs, -1), sigma)
    return np.asarray(found)[: len(pairs.ee)]


def piecewise_pair_evidence(
    rows: LinearRows,
    single: SingleEvidence,
    effects: Sequence[PiecewiseEffect],
    sigma: Prior,
    correlation: int,
) -> dict[tuple[str, str], float]:
    """Compute the log evidence of every pair of effects at one correlation.

    Args:
        rows: the data.
        single: evidences of each effect alone.
        effects: in pieces.
        sigma: prior of the noise sd.
        correlation: index of the AR(1) coefficient.
    """
    cells, owner, log_represented = _representatives(single, correlation)
    slopes = np.concatenate([each.slopes for each in effects])[cells.piece]
    offsets = np.concatenate([each.offsets for each in effects])[cells.piece]
    table = gram_matrix(
        rows, rows.correlations[correlation], np.concatenate([offsets, slopes])
    )
    members = [np.flatnonzero(owner == index) for index in range(len(effects))]
    both = list(combinations(range(len(effects)), 2))
    one = np.concatenate([np.repeat(members[i], len(members[j])) for i, j in both])
    two = np.concatenate([np.tile(members[j], len(members[i])) for i, j in both])
    found = cell_pair_evidence(
        float(single.common.constant[correlation]),
        single.common.rows,
        _pairs(cells, table, one, two),
        sigma,
    )
    weight = cells.log_weight + log_represented[owner]
    weighted = found + weight[one] + weight[two]
    ends = np.cumsum([len(members[i]) * len(members[j]) for i, j in both])
    parts = np.split(weighted, ends[:-1])
    return {
        (single.names[i], single.names[j]): float(np.logaddexp.reduce(part))
        for (i, j), part in zip(both, parts, strict=True)
    }


def _representatives(
    single: SingleEvidence, correlation: int
) -> tuple[AmplitudeCells, np.ndarray, np.ndarray]:
    """Return cells that take part, their effects, and log of what they represent.

    The cells of an effect carry the part of its evidence alone that lies elsewhere.
    """
    exact = single.parts[0]
    evidence = exact.log_evidence[correlation]
    keep, represented = [], []
    for index in range(len(single.names)):
        own = np.flatnonzero(exact.owner == index)
        ranked = own[np.argsort(-evidence[own], kind="stable")]
        best, rest = ranked[:_BEST], np.sort(ranked[_BEST:])
        if len(rest) > _SPREAD:
            rest = rest[((np.arange(_SPREAD) + 0.5) * len(rest) / _SPREAD).astype(int)]
        keep.append(np.concatenate([best, rest]))
        kept = np.logaddexp.reduce(evidence[keep[-1]])
        represented.append(np.logaddexp.reduce(evidence[own]) - kept)
    kept = np.concatenate(keep)
    cells = jax.tree.map(lambda leaf: leaf[kept], exact.cells)
    return cells, exact.owner[kept], np.array(represented)


def _pairs(cells, table: np.ndarray, one: np.ndarray, two: np.ndarray) -> CellPairs:
    """Read the inner products of pairs off the Gram matrix of offsets and slopes."""
    # Row 0 is the reading, then all offsets, then all slopes.
    offset = 1 + np.arange(len(cells.low))
    slope = offset + len(cells.low)

    def left(column):
        # (y − o1 − o2) · column
        return (
            table[0, column] - table[offset[one], column] - table[offset[two], column]
        )

    def both(leaf):
        return np.stack([leaf[one], leaf[two]])

    one_slope, two_slope = slope[one], slope[two]
    return CellPairs(
        ee=left(0) - left(offset[one]) - left(offset[two]),
        eu=np.stack([left(one_slope), left(two_slope)]),
        uu=np.stack(
            [
                table[one_slope, one_slope],
                table[one_slope, two_slope],
                table[two_slope, two_slope],
            ]
        ),
        low=both(cells.low),
        high=both(cells.high),
        mean=both(cells.mean),
        precision=both(cells.precision),
        log_height=cells.log_height[one] + cells.log_height[two],
    )
