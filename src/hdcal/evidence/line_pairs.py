"""Evidence of two effects at once."""

from collections.abc import Sequence
from itertools import combinations

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.evidence.closed_form import Entries
from hdcal.evidence.closed_form_pairs import Couples, couple_evidence
from hdcal.evidence.effect_lines import Lines
from hdcal.evidence.inner_products import gram
from hdcal.evidence.single_evidence import Singles
from hdcal.evidence.whitened_rows import Rows

# Points of each effect that take part: the most probable ones alone, and some
# across its prior for what only shows beside another effect.
_BEST, _SPREAD = 4, 2


def assess_couples(
    rows: Rows,
    singles: Singles,
    lines: Sequence[Lines],
    sigma: Prior,
    correlation: int,
) -> dict[tuple[str, str], float]:
    """Compute the log evidence of every pair of effects at one correlation.

    Args:
        rows: the data.
        singles: evidences of each effect alone.
        lines: of each effect.
        sigma: prior of the noise sd.
        correlation: index of the AR(1) coefficient.
    """
    points, owner, missed = _points(singles, correlation)
    slopes = np.concatenate([each.slopes for each in lines])[points.node]
    offsets = np.concatenate([each.offsets for each in lines])[points.node]
    table = np.asarray(
        gram(rows, rows.correlations[correlation], np.concatenate([offsets, slopes]))
    )
    names = [each.name for each in lines]
    pairs = list(combinations(range(len(names)), 2))
    one = np.concatenate(
        [np.repeat(np.flatnonzero(owner == i), np.sum(owner == j)) for i, j in pairs]
    )
    two = np.concatenate(
        [np.tile(np.flatnonzero(owner == j), np.sum(owner == i)) for i, j in pairs]
    )
    size = [np.sum(owner == i) * np.sum(owner == j) for i, j in pairs]
    found = np.asarray(
        couple_evidence(
            singles.ground.constant[correlation],
            singles.ground.rows,
            _couples(points, table, one, two),
            sigma,
        )
    )
    weight = points.log_weight + missed[owner]
    weighted = found + weight[one] + weight[two]
    ends = np.concatenate([[0], np.cumsum(size)])
    return {
        (names[i], names[j]): float(
            np.logaddexp.reduce(weighted[ends[k] : ends[k + 1]])
        )
        for k, (i, j) in enumerate(pairs)
    }


def _points(
    singles: Singles, correlation: int
) -> tuple[Entries, np.ndarray, np.ndarray]:
    """Return the points that take part, their effects, and log of what they stand for.

    The points of an effect carry the part of its evidence alone that lies elsewhere.
    """
    cells = singles.cells[0]
    evidence = cells.log_evidence[correlation]
    keep, missed = [], []
    for index in range(len(singles.names)):
        own = np.flatnonzero(cells.owner == index)
        ranked = own[np.argsort(-evidence[own], kind="stable")]
        best, rest = ranked[:_BEST], np.sort(ranked[_BEST:])
        if len(rest) > _SPREAD:
            rest = rest[((np.arange(_SPREAD) + 0.5) * len(rest) / _SPREAD).astype(int)]
        keep.append(np.concatenate([best, rest]))
        kept = np.logaddexp.reduce(evidence[keep[-1]])
        missed.append(np.logaddexp.reduce(evidence[own]) - kept)
    kept = np.concatenate(keep)
    points = jax.tree.map(lambda leaf: np.asarray(leaf)[kept], cells.entries)
    return points, cells.owner[kept], np.array(missed)


def _couples(points, table: np.ndarray, one: np.ndarray, two: np.ndarray) -> Couples:
    """Read the inner products of pairs off the Gram matrix of offsets and slopes."""
    count = len(points.node)

    def offset(i):
        return 1 + i

    def slope(i):
        return 1 + count + i

    def left(column):
        # (y − o1 − o2) · column
        return (
            table[0, column] - table[offset(one), column] - table[offset(two), column]
        )

    ee = left(0) - left(offset(one)) - left(offset(two))

    def both(leaf):
        return np.stack([leaf[one], leaf[two]])

    return Couples(
        ee=ee,
        eu=np.stack([left(slope(one)), left(slope(two))]),
        uu=np.stack(
            [
                table[slope(one), slope(one)],
                table[slope(one), slope(two)],
                table[slope(two), slope(two)],
            ]
        ),
        low=both(points.low),
        high=both(points.high),
        mean=both(points.mean),
        precision=both(points.precision),
        log_height=points.log_height[one] + points.log_height[two],
    )
