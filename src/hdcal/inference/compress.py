"""Sufficient statistics of the linear-Gaussian core: cost stops growing with rows.

Within one run, one specimen and one known sd the rows y ~ N(X c, σ²) say no more
than the triangular factor of [X y] and their number:
‖y − X c‖² = ‖R (c, −1)‖².
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array, Records
from hdcal.inference.discrepancy import Discrepancy, discrepancy_columns
from hdcal.inference.padding import append_zeros, bucket_size, pad_records

# Up to this many rows of triangular factors cost little, whatever they replace.
_MANY_FACTOR_ROWS = 10_000


class CompressedRows(eqx.Module):
    """Triangular factors, one for each group of rows that share their noise.

    Attributes:
        factor: R of [X y].
        count: number of rows [-].
        known_sd: stated measurement sd [N].
        run: run index.
        specimen: specimen index.
    """

    factor: Float[Array, "g p p"]
    count: Float[Array, " g"]
    known_sd: Float[Array, " g"]
    run: Int[Array, " g"]
    specimen: Int[Array, " g"]


def group_rows(run, specimen, known_sd) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct (run, specimen, sd) and the group of each row."""
    keys = np.stack([run, specimen, known_sd], axis=1).astype(float)
    if (keys == keys[0]).all():
        return keys[:1], np.zeros(len(keys), dtype=int)
    distinct, group = np.unique(keys, axis=0, return_inverse=True)
    return distinct, group.reshape(-1)


def compress(columns, force, distinct, group) -> CompressedRows:
    """Reduce rows to one triangular factor per group.

    Args:
        columns: X, shape (n, p).
        force: readings y [N], shape (n,).
        distinct: (run, specimen, known sd) of each group, shape (g, 3).
        group: group index of each row, shape (n,).

    Returns:
        One factor per group. Where a stated sd tells rows apart, their number is any
        number: groups of no rows then fill up the bucket.
    """
    table = np.column_stack([columns, force])
    width = table.shape[1]
    factors = np.zeros((len(distinct), width, width))
    count = np.bincount(group, minlength=len(distinct))
    table = table[np.argsort(group, kind="stable")]
    for index, rows in enumerate(np.split(table, np.cumsum(count)[:-1])):
        factor = np.linalg.qr(rows, mode="r")
        factors[index, : len(factor)] = factor
    rows = CompressedRows(
        factors,
        count.astype(float),
        distinct[:, 2],
        distinct[:, 0].astype(int),
        distinct[:, 1].astype(int),
    )
    same_sd = (distinct[:, 2] == distinct[0, 2]).all()
    return rows if same_sd else append_zeros(rows, bucket_size(len(distinct)))


def keep_or_compress(
    records: Records, base_columns, discrepancy: Discrepancy | None, *, keep: bool
) -> dict[str, Any]:
    """Return the fields of a problem that hold its rows, kept or compressed.

    Args:
        records: the measured rows.
        base_columns: of the base model, shape (n, 4).
        discrepancy: of the problem, or None.
        keep: whether the rows must be kept.
    """
    padded, count = pad_records(records), len(records.force)
    columns = discrepancy_columns(discrepancy, padded.deformation)
    if not keep:
        own = [] if columns is None else [columns[:count]]
        blocks = _compress_if_smaller(records, np.hstack([base_columns, *own]))
        if blocks is not None:
            return {"records": None, "columns": None, "blocks": blocks, "count": count}
    return {"records": padded, "columns": columns, "blocks": None, "count": count}


def _compress_if_smaller(records: Records, design) -> CompressedRows | None:
    """Return the rows compressed, or None where that would be no smaller."""
    distinct, group = group_rows(records.run, records.specimen, records.force_sd)
    # One factor per row (an sd of its own in each) would be larger than the rows.
    factor_rows = len(distinct) * (design.shape[1] + 1)
    if factor_rows > max(len(design), _MANY_FACTOR_ROWS):
        return None
    return compress(design, records.force, distinct, group)


def residual(
    blocks: CompressedRows, coefficients: Float[Array, "g p"]
) -> Float[Array, "g p+1"]:
    """Return y − X c of each block in its rotated rows [N]."""
    target = blocks.factor[..., -1]
    fitted = jnp.einsum("gij,gj->gi", blocks.factor[..., :-1], coefficients)
    return target - fitted


def log_likelihood(
    blocks: CompressedRows, coefficients: Float[Array, "g p"], sigma, step
) -> Float[Array, ""]:
    """Return the log likelihood of all rows of all blocks.

    Args:
        blocks: the compressed data.
        coefficients: c of each block [N per column].
        sigma: noise sd before rounding [N].
        step: rounding step [N]; Sheppard's correction adds step²/12 to the variance,
            exact to 2 exp(−2π²σ²/step²).
    """
    variance = sigma**2 + blocks.known_sd**2 + step**2 / 12.0
    squares = jnp.sum(residual(blocks, coefficients) ** 2, axis=-1)
    return -0.5 * jnp.sum(
        blocks.count * jnp.log(2.0 * jnp.pi * variance) + squares / variance
    )
