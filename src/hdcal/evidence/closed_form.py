"""Evidence in closed form: Gaussian in amplitudes, quadrature in the noise sd.

With e the reading beside the base model, u the slope of an effect and V the
projection that its shape tolerance leaves, one piece of an effect has

log p = −n log σ − ½ log|I + v G| − ½ eVe/σ² + log ∫ π(a) exp(−½ A a² + B a) da,
A = uVu/σ², B = uVe/σ², over a cell of the amplitude a.

Pieces, cells and subspaces are padded to few lengths, so that few executables serve
all cases.
"""

from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Float, Int

from hdcal.data.priors import Prior
from hdcal.data.records import Array
from hdcal.evidence.inner_products import (
    CommonTerms,
    PieceProducts,
    SubspaceProducts,
)
from hdcal.exported import jit
from hdcal.inference.distributions import distribution
from hdcal.inference.likelihood import log_interval
from hdcal.inference.padding import bucket_size, repeat_last_row

LOG_2PI = float(np.log(2.0 * np.pi))
# Gauss–Hermite nodes for log σ: its posterior is close to normal.
_POINTS, _WEIGHTS = np.polynomial.hermite.hermgauss(7)
_ITERATIONS = 4
# Wider than the curvature says, so that skewness is covered.
_WIDER = 1.3
# An effect that the rows cannot see at all has no precision; then the prior rules.
TINY = 1e-12

Tree = TypeVar("Tree")


class AmplitudeCells(NamedTuple):
    """Cells of amplitudes on pieces of effects, one entry for each.

    Attributes:
        piece: index of the piece that the cell lies on.
        low: lower end of the amplitude.
        high: upper end.
        size: amplitude to which the shape tolerance is proportional.
        mean: of the amplitude's prior.
        precision: of the amplitude's prior; 0 where the cell is filled evenly.
        log_height: log of the prior density's factor before its exponential.
        log_weight: log prior probability of shape point, scale and tolerance.
        tolerance: relative sd of the shape.
    """

    piece: Int[Array, " m"]
    low: Float[Array, " m"]
    high: Float[Array, " m"]
    size: Float[Array, " m"]
    mean: Float[Array, " m"]
    precision: Float[Array, " m"]
    log_height: Float[Array, " m"]
    log_weight: Float[Array, " m"]
    tolerance: Float[Array, " m"]


def pad_axis(tree: Tree, axis: int) -> Tree:
    """Return arrays whose last entry along an axis is repeated to a shared length."""

    def pad(leaf):
        first = np.moveaxis(np.asarray(leaf), axis, 0)
        return np.moveaxis(repeat_last_row(first, bucket_size(len(first))), 0, axis)

    return jax.tree.map(pad, tree)


def integrate_noise(value, centre, rows, prior: Prior):
    """Integrate exp(value(log σ)) π(log σ) over log σ around a centre."""
    width = _WIDER / jnp.sqrt(2.0 * jnp.maximum(rows - 4.0, 2.0))

    def at(point, weight):
        log_sd = centre + np.sqrt(2.0) * width * point
        log_prior = distribution(prior, "sigma").log_prob(jnp.exp(log_sd)) + log_sd
        return value(log_sd) + log_prior + np.log(weight) + point**2

    # One after the other in the program's text: a loop would take twice as long.
    each = jnp.stack([at(*node) for node in zip(_POINTS, _WEIGHTS, strict=True)])
    return logsumexp(each, axis=0) + 0.5 * jnp.log(2.0 * width**2)


def most_probable_noise(step, start):
    """Iterate a step of log σ until it no longer moves."""
    return jax.lax.fori_loop(0, _ITERATIONS, lambda _, log_sd: step(log_sd), start)


def _log_cell(precision, pull, cells: AmplitudeCells):
    """Return log ∫ π(a) exp(−½ A a² + B a) da over each cell, mean and sd of a.

    Args:
        precision: A, information of the rows on the amplitude.
        pull: B, information times the estimate.
        cells: cells and priors.
    """
    whole = precision + cells.precision + TINY
    drawn = pull + cells.precision * cells.mean
    centre, root = drawn / whole, jnp.sqrt(whole)
    mass = log_interval((cells.low - centre) * root, (cells.high - centre) * root)
    value = (
        0.5 * drawn * centre
        - 0.5 * cells.precision * cells.mean**2
        + 0.5 * (LOG_2PI - jnp.log(whole))
        + mass
        + cells.log_height
    )
    return value, centre, 1.0 / root


def _of_cells(products: PieceProducts, cells: AmplitudeCells) -> PieceProducts:
    """Return the products of each cell's piece, a last axis moved to the front."""
    lengths, tolerance = products[:3], products[3:]
    first = (jnp.moveaxis(leaf, -1, 0) for leaf in tolerance)
    return PieceProducts(*(leaf[..., cells.piece] for leaf in (*lengths, *first)))


def _without_tolerance(own: PieceProducts, cells: AmplitudeCells, log_sd):
    """Integrate the tolerance out: return log factor, eVe, eVu and uVu."""
    loose = (cells.tolerance * cells.size) ** 2 * jnp.exp(-2.0 * log_sd)
    volume, ee, eu, uu = 1.0, own.ee, own.eu, own.uu
    # Written out it is one pass over the cells; eight factors of 1e38 are not reached.
    for spread, te, tu in zip(own.spread, own.te, own.tu, strict=True):
        inside = 1.0 + loose * spread
        factor = loose / inside
        volume *= inside
        ee, eu, uu = ee - factor * te**2, eu - factor * te * tu, uu - factor * tu**2
    return -0.5 * jnp.log(volume), ee, eu, uu


def _noise_of_cells(common: CommonTerms, own: PieceProducts, cells: AmplitudeCells):
    """Return log of the most probable noise sd of each cell."""

    def step(log_sd):
        _, ee, eu, uu = _without_tolerance(own, cells, log_sd)
        variance = jnp.exp(2.0 * log_sd)
        whole = uu / variance + cells.precision + TINY
        drawn = eu / variance + cells.precision * cells.mean
        size = jnp.clip(drawn / whole, cells.low, cells.high)
        left = ee - 2.0 * size * eu + size**2 * uu
        return 0.5 * jnp.log(jnp.maximum(left, 1e-9 * variance) / common.rows)

    return most_probable_noise(step, 0.5 * jnp.log(own.ee / common.rows))


@jit
def _cell_evidence(common, products, cells, sigma: Prior):
    own = _of_cells(products, cells)
    centre = _noise_of_cells(common, own, cells)

    def value(log_sd):
        factor, ee, eu, uu = _without_tolerance(own, cells, log_sd)
        variance = jnp.exp(2.0 * log_sd)
        cell, _, _ = _log_cell(uu / variance, eu / variance, cells)
        return factor - common.rows * log_sd - 0.5 * ee / variance + cell

    total = integrate_noise(value, centre, common.rows, sigma)
    _, _, eu, uu = _without_tolerance(own, cells, centre)
    variance = jnp.exp(2.0 * centre)
    _, mean, sd = _log_cell(uu / variance, eu / variance, cells)
    constant = common.constant[:, None] - 0.5 * common.rows * LOG_2PI
    return total + constant + cells.log_weight, mean, sd


def cell_evidence(
    common: CommonTerms, products: PieceProducts, cells: AmplitudeCells, sigma: Prior
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the log evidence of each cell, and the amplitude given it.

    Args:
        common: what all hypotheses share.
        products: of the pieces.
        cells: of the amplitudes.
        sigma: prior of the noise sd.

    Returns:
        Log evidence with the cell's own prior weight, its amplitude's mean and sd
        before the cell cuts it; each [correlation, cell].
    """
    padded = pad_axis(products, 1), pad_axis(cells, 0)
    found = _cell_evidence(common, *padded, sigma)
    evidence, mean, sd = (np.asarray(part)[:, : len(cells.low)] for part in found)
    return evidence, mean, sd


@jit
def _subspace_evidence(common, products, scale, log_weight, sigma: Prior):
    def parts(log_sd):
        loose = (scale**2 * jnp.exp(-2.0 * log_sd))[..., None]
        spread, be = products.spread[:, :, None], products.be[:, :, None]
        inside = 1.0 + loose * spread
        left = products.ee[:, :, None] - jnp.sum(loose / inside * be**2, axis=-1)
        return jnp.sum(jnp.log(inside), axis=-1), left

    def step(log_sd):
        return 0.5 * jnp.log(jnp.maximum(parts(log_sd)[1], 1e-12) / common.rows)

    start = 0.5 * jnp.log(products.ee / common.rows)[:, :, None] + 0.0 * scale
    log_sd = most_probable_noise(step, start)

    def value(at):
        log_det, left = parts(at)
        return -common.rows * at - 0.5 * log_det - 0.5 * left * jnp.exp(-2.0 * at)

    total = integrate_noise(value, log_sd, common.rows, sigma)
    constant = common.constant[:, None, None] - 0.5 * common.rows * LOG_2PI
    return total + constant + log_weight


def subspace_evidence(
    common: CommonTerms,
    products: SubspaceProducts,
    scale: Float[np.ndarray, "b t"],
    log_weight: Float[np.ndarray, "b t"],
    sigma: Prior,
) -> Float[np.ndarray, "r b t"]:
    """Return the log evidence of each subspace at each scale.

    Args:
        common: what all hypotheses share.
        products: of the subspaces.
        scale: factor on the columns, one of several.
        log_weight: log prior probability of each.
        sigma: prior of the noise sd.

    Returns:
        Log evidence, [correlation, subspace, scale].
    """
    padded = pad_axis(products, 1), *pad_axis((scale, log_weight), 0)
    return np.asarray(_subspace_evidence(common, *padded, sigma))[:, : len(scale)]


def base_evidence(
    common: CommonTerms, ee: Float[np.ndarray, " r"], sigma: Prior
) -> Float[np.ndarray, " r"]:
    """Return the log evidence without any effect: of a subspace without columns.

    Args:
        common: what all hypotheses share.
        ee: squared length of the reading beside the base model, [correlation].
        sigma: prior of the noise sd.
    """
    nothing, one = np.zeros((len(ee), 1, 0)), np.ones((1, 1))
    products = SubspaceProducts(ee[:, None], nothing, nothing)
    return subspace_evidence(common, products, one, 0.0 * one, sigma)[:, 0, 0]
