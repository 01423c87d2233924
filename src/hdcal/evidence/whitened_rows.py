"""Rows as the evidence sees them: base columns, whitening, projection."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from hdcal.data.records import Array

# AR(1) coefficients of the noise within a run that are integrated over; more would
# swallow slow physics.
CORRELATIONS = (0.0, 0.2, 0.4, 0.6)


class Rows(eqx.Module):
    """The data of one case and what every hypothesis may absorb.

    Attributes:
        reading: measured force less the prior mean of the base model [N].
        base: columns that the base model can absorb [N per prior unit].
        precision: prior precision of their coefficients times the noise variance.
        before: index of the row before in the same run, −1 for a run's first.
        weight: one over the relative noise sd of each row [-].
        correlations: AR(1) coefficients.
        tolerance: smooth functions of unit mean square, shape (j, n), with which an
            effect's shape may differ from the library's.
    """

    reading: Float[Array, " n"]
    base: Float[Array, "n p"]
    precision: Float[Array, " p"]
    before: Int[Array, " n"]
    weight: Float[Array, " n"]
    correlations: Float[Array, " r"]
    tolerance: Float[Array, "j n"]


@jax.jit
def whiten(rows: Rows, columns: Array, correlation) -> Array:
    """Return columns in which the noise is independent and of equal sd.

    Args:
        rows: order and weights of the rows.
        columns: with the rows along their first axis.
        correlation: AR(1) coefficient of the noise within a run.
    """
    scaled = jnp.moveaxis(columns, 0, -1) * rows.weight
    lagged = (scaled - correlation * scaled[..., rows.before]) / jnp.sqrt(
        1.0 - correlation**2
    )
    return jnp.moveaxis(jnp.where(rows.before < 0, scaled, lagged), -1, 0)


def whitening_jacobian(rows: Rows, correlation) -> Float[Array, ""]:
    """Return log |d whitened / d reading|."""
    following = jnp.sum(rows.before >= 0)
    return jnp.sum(jnp.log(rows.weight)) - 0.5 * following * jnp.log(
        1.0 - correlation**2
    )


def log_absorbed(rows: Rows, correlation) -> Float[Array, ""]:
    """Return log |P| for P = (I + X S X')⁻¹ in whitened rows.

    The base coefficients have prior precision `rows.precision`/σ²; zero columns are
    harmless.
    """
    base = whiten(rows, rows.base, correlation)
    gram = base.T @ base + jnp.diag(rows.precision)
    factor = jnp.linalg.cholesky(gram)
    return jnp.sum(jnp.log(rows.precision)) - 2.0 * jnp.sum(jnp.log(jnp.diag(factor)))


@jax.jit
def beside_line(rows: Rows, curves: Float[Array, "g n"]) -> Float[Array, "g n"]:
    """Return what of each curve the base model cannot absorb: its visible size [N].

    As far as its priors let it: no zero of the deformation makes up for a drift with
    temperature.
    """
    base = rows.base
    gram = base.T @ base + jnp.diag(rows.precision)
    return curves - (curves @ base) @ jnp.linalg.solve(gram, base.T)
