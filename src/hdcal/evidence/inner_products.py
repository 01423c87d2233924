"""The few inner products that hold all that the rows say about a hypothesis."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.evidence.whitened_rows import (
    Rows,
    beside_line,
    log_absorbed,
    whiten,
    whitening_jacobian,
)


class Ground(eqx.Module):
    """What all hypotheses share, one entry per correlation.

    Attributes:
        constant: log of the determinants of whitening and base model.
        rows: number of rows.
    """

    constant: Float[Array, " r"]
    rows: Float[Array, ""] | float


class Nodes(eqx.Module):
    """Lines e = y − o, u in the space beside the base model; [correlation, node].

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


class Blocks(eqx.Module):
    """Subspaces with one prior variance each; [correlation, block].

    Attributes:
        ee: squared length of the reading beside the base model.
        spread: eigenvalues of the Gram matrix of the columns, [r, b, j].
        be: rotated products with the reading.
    """

    ee: Float[Array, "r b"]
    spread: Float[Array, "r b j"]
    be: Float[Array, "r b j"]


@jax.jit
def ground(rows: Rows) -> Ground:
    """Return what every hypothesis shares."""

    def one(correlation):
        log_det = log_absorbed(rows, correlation)
        return whitening_jacobian(rows, correlation) + 0.5 * log_det

    return Ground(jax.vmap(one)(rows.correlations), float(rows.reading.shape[0]))


def project(rows: Rows, correlation, columns):
    """Return columns whose inner products are those of P, not of P P.

    P = (I + X S X')⁻¹ is no projection where the base's priors hold it back: what
    these cost is kept in as many further entries as the base has columns.
    """
    base = whiten(rows, rows.base, correlation)
    gram = base.T @ base + jnp.diag(rows.precision)
    white = whiten(rows, columns.T, correlation).T
    fitted = jnp.linalg.solve(gram, base.T @ white.T).T
    held = jnp.sqrt(rows.precision) * fitted
    return jnp.concatenate([white - fitted @ base.T, held], axis=1)


@jax.jit
def line_statistics(
    rows: Rows, offsets: Float[Array, "g n"], slopes: Float[Array, "g n"]
) -> Nodes:
    """Reduce lines of curves to their inner products, without tolerance.

    Args:
        rows: the data.
        offsets: contribution at amplitude zero of each line [N].
        slopes: change per unit of the amplitude [N].
    """

    def one(correlation):
        left = project(rows, correlation, rows.reading[None] - offsets)
        slope = project(rows, correlation, slopes)
        nothing = jnp.zeros((len(offsets), 0))
        return (*_lengths(left, slope), nothing, nothing, nothing)

    return Nodes(*jax.lax.map(one, rows.correlations))


def _lengths(left, slope):
    return (
        jnp.sum(left**2, axis=1),
        jnp.sum(left * slope, axis=1),
        jnp.sum(slope**2, axis=1),
    )


@jax.jit
def tolerant_statistics(
    rows: Rows,
    offsets: Float[Array, "g n"],
    slopes: Float[Array, "g n"],
    shapes: Float[Array, "g n"],
) -> Nodes:
    """Reduce lines and the tolerance of their shapes to inner products.

    Args:
        rows: the data.
        offsets: contribution at amplitude zero of each line [N].
        slopes: change per unit of the amplitude [N].
        shapes: contribution per unit of the amplitude whose shape is uncertain [N].
    """
    wiggles = beside_line(rows, shapes)[:, None] * rows.tolerance
    flat = wiggles.reshape(-1, wiggles.shape[-1])

    def one(correlation):
        left = project(rows, correlation, rows.reading[None] - offsets)
        slope = project(rows, correlation, slopes)
        loose = project(rows, correlation, flat).reshape(*wiggles.shape[:2], -1)
        spread, rotation = jnp.linalg.eigh(loose @ jnp.swapaxes(loose, 1, 2))
        both = loose @ jnp.stack([left, slope], axis=2)
        te, tu = jnp.moveaxis(jnp.swapaxes(rotation, 1, 2) @ both, 2, 0)
        return (*_lengths(left, slope), jnp.maximum(spread, 0.0), te, tu)

    return Nodes(*jax.lax.map(one, rows.correlations))


@jax.jit
def block_statistics(rows: Rows, columns: Float[Array, "b j n"]) -> Blocks:
    """Reduce subspaces to their inner products; zero columns are harmless.

    Args:
        rows: the data.
        columns: of each subspace, per unit of its prior sd [N].
    """

    def one(correlation):
        left = project(rows, correlation, rows.reading[None])[0]

        def each(block):
            inside = project(rows, correlation, block)
            spread, rotation = jnp.linalg.eigh(inside @ inside.T)
            return jnp.maximum(spread, 0.0), rotation.T @ (inside @ left)

        spread, be = jax.lax.map(each, columns)
        return jnp.broadcast_to(left @ left, spread.shape[:1]), spread, be

    return Blocks(*jax.lax.map(one, rows.correlations))


@jax.jit
def gram(
    rows: Rows, correlation, curves: Float[Array, "m n"]
) -> Float[Array, "m+1 m+1"]:
    """Return all inner products of the reading (first) and curves, projected."""
    table = jnp.concatenate([rows.reading[None], curves])
    inside = project(rows, correlation, table)
    return inside @ inside.T
