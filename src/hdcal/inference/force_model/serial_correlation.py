"""Correlated noise within a run: autoregressive of first order.

In noise sds e, z₁ = e₁ and zₜ = (eₜ − ρ eₜ₋₁) / √(1 − ρ²) are independent and of unit
variance. What is linear in the rows is whitened in the same way, and
log |dz/de| = −½ m log(1 − ρ²) with m the rows that follow another one.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array, Records

# Its site in the model.
CORRELATION = "noise_correlation"


def previous_rows(records: Records) -> Int[np.ndarray, " n"]:
    """Return the index of the row before in the same run, −1 for a run's first.

    Runs may alternate. On another specimen a run is another one.
    """
    labels = np.asarray(records.run), np.asarray(records.specimen)
    order = np.lexsort(labels)
    same = np.all([np.diff(label[order]) == 0 for label in labels], axis=0)
    before = np.full(len(order), -1)
    before[order[1:][same]] = order[:-1][same]
    return before


def whiten(columns, before, correlation):
    """Return columns of rows, in noise sds, in which the noise is independent.

    Rows are along the first axis; `before` is from `previous_rows`.
    """
    follows = (before >= 0).reshape(-1, *(1,) * (columns.ndim - 1))
    gain = (1.0 - correlation**2) ** -0.5
    scale = 1.0 + (gain - 1.0) * follows
    return scale * columns - (correlation * gain) * follows * columns[before]


def log_volume(following, correlation) -> Float[Array, "*r"]:
    """Return log |de/dz| at each ρ, by NumPy where that is no array of JAX."""
    xp = jnp if isinstance(correlation, jax.Array) else np
    return 0.5 * following * xp.log1p(-(correlation**2))


def whitened_products(
    table: np.ndarray, before: np.ndarray, correlation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return inner products of whitened columns (r, p, p), and log |dz/de| (r,).

    The table (m, p) is in noise sds, its rows after the n of `before` independent; the
    correlation is each ρ, (r,).
    """
    (follows,) = np.nonzero(before >= 0)
    now, earlier = table[follows], table[before[follows]]
    first = np.delete(table, follows, axis=0)
    crossed, rho = now.T @ earlier, correlation[:, None, None]
    rows = now.T @ now - rho * (crossed + crossed.T) + rho**2 * (earlier.T @ earlier)
    products = first.T @ first + rows / (1.0 - rho**2)
    return products, -np.asarray(log_volume(len(follows), correlation))
