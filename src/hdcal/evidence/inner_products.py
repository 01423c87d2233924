"""The few inner products that hold all that the rows say about a hypothesis."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.evidence.linear_rows import (
    LinearRows,
    log_det_projection,
    log_det_whitening,
    project,
    remove_base,
)

# Share of the reading that is left of an exact fit, or noise of no size would follow.
_EXACT = 1e-5


class CommonTerms(NamedTuple):
    """What all hypotheses share, one entry per correlation.

    Attributes:
        constant: log of the determinants of whitening and base model.
        rows: number of rows.
    """

    constant: Float[Array, " r"]
    rows: float


class PieceProducts(NamedTuple):
    """Pieces e = y − o, u in the space beside the base model; [correlation, piece].

    Attributes:
        ee: squared length of what is left of the reading.
        eu: its product with the slope.
        uu: squared length of the slope.
        spread: eigenvalues of the tolerance's Gram matrix, [r, g, j].
        te: rotated products of the tolerance with the reading.
        tu: the same with the slope.
    """

    ee: Float[Array, "r g"]
    eu: Float[Array, "r g"]
    uu: Float[Array, "r g"]
    spread: Float[Array, "r g j"]
    te: Float[Array, "r g j"]
    tu: Float[Array, "r g j"]


class SubspaceProducts(NamedTuple):
    """Subspaces with one prior variance each; [correlation, subspace].

    Attributes:
        ee: squared length of the reading beside the base model.
        spread: eigenvalues of the Gram matrix of the columns, [r, b, j].
        be: rotated products with the reading.
    """

    ee: Float[Array, "r b"]
    spread: Float[Array, "r b j"]
    be: Float[Array, "r b j"]


def common_terms(rows: LinearRows) -> CommonTerms:
    """Return what every hypothesis shares."""
    base = np.array([log_det_projection(rows, c) for c in rows.correlations])
    constant = log_det_whitening(rows, rows.correlations) + 0.5 * base
    return CommonTerms(constant, float(len(rows.reading)))


def piece_products(
    rows: LinearRows,
    offsets: Float[np.ndarray, "g n"],
    slopes: Float[np.ndarray, "g n"],
    shapes: Float[np.ndarray, "g n"] | None = None,
) -> PieceProducts:
    """Reduce pieces of effects to their inner products.

    Args:
        rows: the data.
        offsets: contribution at amplitude zero of each piece [N].
        slopes: change per unit of the amplitude [N].
        shapes: contribution per unit of the amplitude whose shape is uncertain [N];
            None for exact shapes.
    """
    deviations = np.zeros((len(slopes), 0, slopes.shape[1]))
    if shapes is not None:
        deviations = remove_base(rows, shapes)[:, None] * rows.tolerance
    flat = deviations.reshape(-1, slopes.shape[1])
    parts = []
    for correlation in rows.correlations:
        left = project(rows, correlation, rows.reading - offsets)
        slope = project(rows, correlation, slopes)
        lengths = [np.sum(a * b, axis=1) for a, b in ((left, left), (left, slope))]
        lengths[0] = np.maximum(lengths[0], _least_square(rows))
        loose = project(rows, correlation, flat)
        loose = loose.reshape(*deviations.shape[:2], slope.shape[1])
        both = np.stack([left, slope], axis=1)
        spread, (te, tu) = _along_axes(loose, both)
        parts.append((*lengths, np.sum(slope**2, axis=1), spread, te, tu))
    return PieceProducts(*map(np.stack, zip(*parts, strict=True)))


def subspace_products(
    rows: LinearRows, columns: Float[np.ndarray, "b j n"]
) -> SubspaceProducts:
    """Reduce subspaces to their inner products; zero columns change nothing.

    Args:
        rows: the data.
        columns: of each subspace, per unit of its prior sd [N].
    """
    count, parts, there = len(columns), [], np.any(columns != 0.0, axis=2)
    for correlation in rows.correlations:
        left = project(rows, correlation, rows.reading[None])[0]
        inside = np.zeros((*there.shape, len(left)))
        inside[there] = project(rows, correlation, columns[there])
        reading = np.broadcast_to(left, (count, 1, len(left)))
        spread, (be,) = _along_axes(inside, reading)
        square = max(float(left @ left), _least_square(rows))
        parts.append((np.full(count, square), spread, be))
    return SubspaceProducts(*map(np.stack, zip(*parts, strict=True)))


def _least_square(rows: LinearRows) -> float:
    """Return the squared length of the reading that an exact fit is taken to leave."""
    return _EXACT**2 * float(np.sum(np.asarray(rows.reading) ** 2))


def _along_axes(columns: np.ndarray, others: np.ndarray):
    """Return squared lengths of the principal axes of columns, and products with them.

    Args:
        columns: of each subspace, shape (b, j, n).
        others: vectors, shape (b, k, n).

    Returns:
        Shapes (b, j) and (k, b, j).
    """
    spread, rotation = np.linalg.eigh(columns @ np.swapaxes(columns, 1, 2))
    products = others @ np.swapaxes(columns, 1, 2) @ rotation
    return np.maximum(spread, 0.0), np.moveaxis(products, 1, 0)


def gram_matrix(
    rows: LinearRows, correlation: float, curves: Float[np.ndarray, "m n"]
) -> Float[np.ndarray, "m+1 m+1"]:
    """Return all inner products of the reading (first) and curves, projected."""
    inside = project(
        rows, correlation, np.concatenate([np.asarray(rows.reading)[None], curves])
    )
    return inside @ inside.T
