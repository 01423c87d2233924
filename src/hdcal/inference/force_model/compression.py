"""Sufficient statistics of the linear-Gaussian core: cost stops growing with rows.

Within one run and one specimen the rows y ~ N(X c, σ²) say no more than the triangular
factor of [X y] and their number: ‖y − X c‖² = ‖R (c, −1)‖².
Where neighbours are correlated, so do rows and the rows before them, kept side by side.
"""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array, Records


class CompressedRows(eqx.Module):
    """Triangular factors and numbers of rows, for each run on each specimen."""

    # R of [X y]. Until `whitened` is called, only of rows without a predecessor.
    factor: Float[Array, "g r p"]
    count: Float[Array, " g"]
    run: Int[Array, " g"]
    specimen: Int[Array, " g"]
    known_sd: Float[Array, ""] | float
    # R of [X y X' y'] with X' and y' of the row before; None without correlation.
    pairs: Float[Array, "g q q"] | None
    # Number of rows that follow another one.
    following: Float[Array, " g"]

    def whitened(self, correlation) -> "CompressedRows":
        """Return factors of rows in which the noise is independent."""
        if self.pairs is None:
            return self
        now, before = jnp.split(self.pairs, 2, axis=-1)
        white = (now - correlation * before) / jnp.sqrt(1.0 - correlation**2)
        factor = jnp.concatenate([self.factor, white], axis=1)
        return replace(self, factor=factor, pairs=None)


def compress(
    columns: np.ndarray, records: Records, before: np.ndarray | None = None
) -> CompressedRows | None:
    """Reduce rows to one triangular factor per run and specimen, or two.

    None where the stated sd of a reading differs from row to row. `columns` are X,
    (n, p); `before` is None where neighbours are not correlated.
    """
    if np.ptp(records.force_sd) > 0.0:
        return None
    run, specimen = np.asarray(records.run), np.asarray(records.specimen)
    labels = run + (run.max() + 1) * specimen
    _, first, group = np.unique(labels, return_index=True, return_inverse=True)
    table, size = np.column_stack([columns, records.force]), len(first)
    first_rows, pairs = np.full(len(table), True), None
    if before is not None:
        first_rows = before < 0
        both = np.hstack([table[~first_rows], table[before[~first_rows]]])
        pairs = _factors(both, group[~first_rows], size)
    return CompressedRows(
        factor=_factors(table[first_rows], group[first_rows], size),
        count=np.bincount(group, minlength=size).astype(float),
        run=run[first],
        specimen=specimen[first],
        known_sd=float(records.force_sd[0]),
        pairs=pairs,
        following=np.bincount(group[~first_rows], minlength=size).astype(float),
    )


def _factors(table: np.ndarray, group: np.ndarray, size: int) -> np.ndarray:
    """Return the triangular factor of each group, padded with rows of zeros."""
    width = table.shape[1]
    factors = np.zeros((size, width, width))
    for index in range(size):
        factor = np.linalg.qr(table[group == index], mode="r")
        factors[index, : len(factor)] = factor
    return factors
