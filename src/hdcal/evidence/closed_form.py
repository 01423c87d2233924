"""Evidence in closed form: Gaussian in amplitudes, quadrature in the noise sd.

With e the reading beside the base model, u the slope of an effect and V the
projection that its shape tolerance leaves, a line of readings has

log p = −n log σ − ½ log|I + v G| − ½ eVe/σ² + log ∫ π(a) exp(−½ A a² + B a) da,
A = uVu/σ², B = uVe/σ², over a cell of the amplitude a.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Float, Int

from hdcal.data.priors import Prior
from hdcal.data.records import Array
from hdcal.evidence.inner_products import Blocks, Ground, Nodes
from hdcal.inference.distributions import distribution
from hdcal.inference.likelihood import log_interval

LOG_2PI = float(np.log(2.0 * np.pi))
# Gauss–Hermite nodes for log σ: its posterior is close to normal.
_POINTS, _WEIGHTS = np.polynomial.hermite.hermgauss(7)
_ITERATIONS = 4
# Wider than the curvature says, so that skewness is covered.
_WIDER = 1.3
# An effect that the rows cannot see at all has no precision; then the prior rules.
TINY = 1e-12


class Entries(eqx.Module):
    """Cells of amplitudes on nodes, one entry for each.

    Attributes:
        node: whose line the cell lies on.
        low: lower end of the amplitude.
        high: upper end.
        size: amplitude to which the shape tolerance is proportional.
        mean: of the amplitude's prior.
        precision: of the amplitude's prior; 0 where the cell is filled evenly.
        log_height: log of the prior density's factor before its exponential.
        log_weight: log prior probability of shape point and scale.
        tolerance: relative sd of the shape.
    """

    node: Int[Array, " m"]
    low: Float[Array, " m"]
    high: Float[Array, " m"]
    size: Float[Array, " m"]
    mean: Float[Array, " m"]
    precision: Float[Array, " m"]
    log_height: Float[Array, " m"]
    log_weight: Float[Array, " m"]
    tolerance: Float[Array, " m"]


def _log_noise(prior: Prior, log_sd):
    return distribution(prior).log_prob(jnp.exp(log_sd)) + log_sd


def over_noise(value, centre, rows, prior: Prior):
    """Integrate exp(value(log σ)) over log σ around a centre."""
    width = _WIDER / jnp.sqrt(2.0 * jnp.maximum(rows - 4.0, 2.0))

    def at(node):
        point, log_weight = node
        log_sd = centre + np.sqrt(2.0) * width * point
        return value(log_sd) + _log_noise(prior, log_sd) + log_weight + point**2

    nodes = jnp.asarray(_POINTS), jnp.log(_WEIGHTS)
    return logsumexp(jax.lax.map(at, nodes), axis=0) + 0.5 * jnp.log(2.0 * width**2)


def settle(step, start):
    """Iterate a step until the most probable noise no longer moves."""
    return jax.lax.fori_loop(0, _ITERATIONS, lambda _, log_sd: step(log_sd), start)


def log_cell(precision, pull, entries: Entries):
    """Return log ∫ π(a) exp(−½ A a² + B a) da over each cell, mean and sd of a.

    Args:
        precision: A, information of the rows on the amplitude.
        pull: B, information times the estimate.
        entries: cells and priors.
    """
    whole = precision + entries.precision + TINY
    drawn = pull + entries.precision * entries.mean
    centre, root = drawn / whole, jnp.sqrt(whole)
    mass = log_interval((entries.low - centre) * root, (entries.high - centre) * root)
    value = (
        0.5 * drawn * centre
        - 0.5 * entries.precision * entries.mean**2
        + 0.5 * (LOG_2PI - jnp.log(whole))
        + mass
        + entries.log_height
    )
    return value, centre, 1.0 / root


def _marginal(nodes: Nodes, entries: Entries, log_sd):
    """Integrate the tolerance out: return log factor, eVe, eVu and uVu."""
    own = jax.tree.map(lambda leaf: leaf[:, entries.node], nodes)
    loose = ((entries.tolerance * entries.size) ** 2 * jnp.exp(-2.0 * log_sd))[
        ..., None
    ]
    factor = loose / (1.0 + loose * own.spread)
    return (
        -0.5 * jnp.sum(jnp.log1p(loose * own.spread), axis=-1),
        own.ee - jnp.sum(factor * own.te**2, axis=-1),
        own.eu - jnp.sum(factor * own.te * own.tu, axis=-1),
        own.uu - jnp.sum(factor * own.tu**2, axis=-1),
    )


def _noise_of_entries(ground: Ground, nodes: Nodes, entries: Entries):
    """Return log of the most probable noise sd of each entry."""

    def step(log_sd):
        _, ee, eu, uu = _marginal(nodes, entries, log_sd)
        variance = jnp.exp(2.0 * log_sd)
        whole = uu / variance + entries.precision + TINY
        drawn = eu / variance + entries.precision * entries.mean
        size = jnp.clip(drawn / whole, entries.low, entries.high)
        left = ee - 2.0 * size * eu + size**2 * uu
        return 0.5 * jnp.log(jnp.maximum(left, 1e-9 * variance) / ground.rows)

    return settle(step, 0.5 * jnp.log(nodes.ee[:, entries.node] / ground.rows))


@jax.jit
def entry_evidence(ground: Ground, nodes: Nodes, entries: Entries, sigma: Prior):
    """Return the log evidence of each entry, and the amplitude given it.

    Args:
        ground: what all hypotheses share.
        nodes: inner products.
        entries: cells.
        sigma: prior of the noise sd.

    Returns:
        Log evidence with the entry's own prior weight, its amplitude's mean and sd
        before the cell cuts it; each [correlation, entry].
    """
    centre = _noise_of_entries(ground, nodes, entries)

    def value(log_sd):
        factor, ee, eu, uu = _marginal(nodes, entries, log_sd)
        variance = jnp.exp(2.0 * log_sd)
        cell, _, _ = log_cell(uu / variance, eu / variance, entries)
        return factor - ground.rows * log_sd - 0.5 * ee / variance + cell

    total = over_noise(value, centre, ground.rows, sigma)
    _, _, eu, uu = _marginal(nodes, entries, centre)
    variance = jnp.exp(2.0 * centre)
    _, mean, sd = log_cell(uu / variance, eu / variance, entries)
    common = ground.constant[:, None] - 0.5 * ground.rows * LOG_2PI
    return total + common + entries.log_weight, mean, sd


@jax.jit
def block_evidence(
    ground: Ground,
    blocks: Blocks,
    scale: Float[Array, "b t"],
    log_weight: Float[Array, "b t"],
    sigma: Prior,
):
    """Return the log evidence of each subspace at each scale.

    Args:
        ground: what all hypotheses share.
        blocks: inner products.
        scale: factor on the columns, one of several.
        log_weight: log prior probability of each.
        sigma: prior of the noise sd.

    Returns:
        Log evidence, [correlation, block, scale].
    """

    def parts(log_sd):
        loose = (scale**2 * jnp.exp(-2.0 * log_sd))[..., None]
        spread, be = blocks.spread[:, :, None], blocks.be[:, :, None]
        inside = 1.0 + loose * spread
        left = blocks.ee[:, :, None] - jnp.sum(loose / inside * be**2, axis=-1)
        return jnp.sum(jnp.log(inside), axis=-1), left

    def step(log_sd):
        return 0.5 * jnp.log(jnp.maximum(parts(log_sd)[1], 1e-12) / ground.rows)

    start = 0.5 * jnp.log(blocks.ee / ground.rows)[:, :, None] + 0.0 * scale
    log_sd = settle(step, start)

    def value(at):
        log_det, left = parts(at)
        return -ground.rows * at - 0.5 * log_det - 0.5 * left * jnp.exp(-2.0 * at)

    total = over_noise(value, log_sd, ground.rows, sigma)
    common = ground.constant[:, None, None] - 0.5 * ground.rows * LOG_2PI
    return total + common + log_weight


@jax.jit
def plain_evidence(ground: Ground, ee: Float[Array, " r"], sigma: Prior):
    """Return the log evidence without any effect, one for each correlation."""
    centre = 0.5 * jnp.log(ee / ground.rows)

    def value(log_sd):
        return -ground.rows * log_sd - 0.5 * ee * jnp.exp(-2.0 * log_sd)

    total = over_noise(value, centre, ground.rows, sigma)
    return total + ground.constant - 0.5 * ground.rows * LOG_2PI
