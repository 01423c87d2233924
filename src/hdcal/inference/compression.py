"""Sufficient statistics of the linear-Gaussian core: cost stops growing with rows.

Within one run, one specimen and one known sd the rows y ~ N(X c, σ²) say no more
than the triangular factor of [X y] and their number:
‖y − X c‖² = ‖R (c, −1)‖².
Where neighbours are correlated, so do rows and the rows before them, kept side by side.
"""

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array, Records
from hdcal.inference.discrepancy import Discrepancy, discrepancy_columns
from hdcal.inference.padding import append_zeros, bucket_size, pad_records
from hdcal.inference.serial_correlation import previous_rows

# Up to this many rows of triangular factors cost little, whatever they replace.
_MANY_FACTOR_ROWS = 10_000


class CompressedRows(eqx.Module):
    """Triangular factors, one for each group of rows that share their noise.

    Attributes:
        factor: R of [X y]; before `whitened`, of rows that follow no other one.
        count: number of rows [-].
        known_sd: stated measurement sd [N].
        sd_before: stated measurement sd of the row before, if there is one [N].
        run: run index.
        specimen: specimen index.
        pairs: R of [X y X' y'] with X' and y' of the row before, or None where
            neighbours are not correlated.
        following: number of rows that follow another one [-].
    """

    factor: Float[Array, "g r p"]
    count: Float[Array, " g"]
    known_sd: Float[Array, " g"]
    sd_before: Float[Array, " g"]
    run: Int[Array, " g"]
    specimen: Int[Array, " g"]
    pairs: Float[Array, "g q q"] | None
    following: Float[Array, " g"]

    def variance(self, sigma, step) -> Float[Array, " g"]:
        """Return the variance of a reading [N²], by Sheppard's correction.

        That is exact to 2 exp(−2π²σ²/step²).

        Args:
            sigma: noise sd before rounding [N].
            step: rounding step [N].
        """
        return sigma**2 + self.known_sd**2 + step**2 / 12.0

    def whitened(self, correlation, sigma, step) -> "CompressedRows":
        """Return factors of rows in which the noise is independent."""
        if self.pairs is None:
            return self
        now, before = jnp.split(self.pairs, 2, axis=-1)
        earlier = replace(self, known_sd=self.sd_before).variance(sigma, step)
        ratio = jnp.sqrt(self.variance(sigma, step) / earlier)[:, None, None]
        white = (now - correlation * ratio * before) / jnp.sqrt(1.0 - correlation**2)
        factor = jnp.concatenate([self.factor, white], axis=1)
        return replace(self, factor=factor, pairs=None)


def keep_or_compress(
    records: Records,
    base_columns: np.ndarray,
    discrepancy: Discrepancy | None,
    keep: bool,
    correlated: bool,
) -> dict[str, Any]:
    """Return the fields of a problem that hold its rows, kept or compressed.

    Args:
        records: the measured rows.
        base_columns: of the base model, shape (n, 4).
        discrepancy: of the problem, or None.
        keep: whether the rows must be kept.
        correlated: whether neighbours within a run may be correlated.
    """
    padded, count = pad_records(records), len(records.force)
    columns = discrepancy_columns(discrepancy, padded)
    before = previous_rows(records) if correlated else None
    shapes = np.empty((count, 0)) if columns is None else columns[:count]
    design = np.hstack([base_columns, shapes])
    blocks = None if keep else _compress_if_smaller(records, design, before)
    kept: dict[str, Any] = dict.fromkeys(("records", "columns", "before"))
    if blocks is None:
        if before is not None:
            padding = (0, len(padded.force) - count)
            before = np.pad(before, padding, constant_values=-1)
        kept = {"records": padded, "columns": columns, "before": before}
    return {**kept, "blocks": blocks, "count": count}


def _compress_if_smaller(records: Records, design, before) -> CompressedRows | None:
    """Return the rows compressed, or None where that would be no smaller."""
    sd = np.asarray(records.force_sd)
    earlier = sd if before is None else np.where(before < 0, sd, sd[before])
    distinct, group = group_rows(records.run, records.specimen, sd, earlier)
    # One factor per row, where every sd differs, would be larger than the rows.
    factor_rows = len(distinct) * (design.shape[1] + 1)
    if factor_rows > max(len(design), _MANY_FACTOR_ROWS):
        return None
    return compress(design, records.force, distinct, group, before)


def group_rows(run, specimen, *known_sd) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct (run, specimen, sd, …) and the group of each row."""
    keys = [np.asarray(key, float) for key in (run, specimen, *known_sd)]
    if all((key == key[0]).all() for key in keys):
        return np.stack(keys, axis=1)[:1], np.zeros(len(keys[0]), dtype=int)
    distinct, group = np.unique(np.stack(keys, axis=1), axis=0, return_inverse=True)
    return distinct, group.reshape(-1)


def compress(columns, force, distinct, group, before=None) -> CompressedRows:
    """Reduce rows to one triangular factor per group, or two.

    Where groups differ in a stated sd, groups of no rows fill up a bucket.

    Args:
        columns: X, shape (n, p).
        force: readings y [N], shape (n,).
        distinct: run, specimen, known sd and that of the row before, of each group,
            shape (g, 4).
        group: group index of each row, shape (n,).
        before: index of the row before each, −1 for none; None where neighbours are
            not correlated.
    """
    table, size = np.column_stack([columns, force]), len(distinct)
    alone, pairs = np.full(len(group), True), None
    if before is not None:
        alone = before < 0
        both = np.hstack([table[~alone], table[before[~alone]]])
        pairs = _factors(both, group[~alone], size)
    rows = CompressedRows(
        _factors(table[alone], group[alone], size),
        np.bincount(group, minlength=size).astype(float),
        distinct[:, 2],
        distinct[:, 3],
        distinct[:, 0].astype(int),
        distinct[:, 1].astype(int),
        pairs,
        np.bincount(group[~alone], minlength=size).astype(float),
    )
    same_sd = (distinct[:, 2] == distinct[0, 2]).all()
    return rows if same_sd else append_zeros(rows, bucket_size(size))


def _factors(table: np.ndarray, group: np.ndarray, size: int) -> np.ndarray:
    """Return the triangular factor of each group's rows, zeros below few rows."""
    width = table.shape[1]
    factors = np.zeros((size, width, width))
    count = np.bincount(group, minlength=size)
    table = table[np.argsort(group, kind="stable")] if size > 1 else table
    for index, rows in enumerate(np.split(table, np.cumsum(count)[:-1])):
        factor = np.linalg.qr(rows, mode="r")
        factors[index, : len(factor)] = factor
    return factors
