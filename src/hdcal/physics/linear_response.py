"""The exact response of the linear model to a force that is linear between rows.

m ÿ + c ẏ + k y = F(t). Between two rows the particular solution for F = F₀ + s τ is
y_p = (F₀ + s τ)/k − c s/k², and what is left over decays freely, in closed form: no
step size enters, and neither damping nor time steps need be of any kind.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array

Scalar = Float[Array, ""] | float
# Below this |x| the functions of √x are summed as series, smooth through zero.
_SMALL = 1e-4
# Longer records are taken in stretches of so many steps, to bound the memory.
_STRETCH = 16_384


def _cosine(x):
    """Return cos √x, cosh √−x below zero."""
    small = jnp.abs(x) < _SMALL
    root = jnp.sqrt(jnp.where(small, 1.0, jnp.abs(x)))
    far = jnp.where(x > 0.0, jnp.cos(root), jnp.cosh(jnp.minimum(root, 300.0)))
    return jnp.where(small, 1.0 - x * (0.5 - x * (1 / 24 - x / 720)), far)


def _sine(x):
    """Return sin √x / √x, sinh √−x / √−x below zero."""
    small = jnp.abs(x) < _SMALL
    root = jnp.sqrt(jnp.where(small, 1.0, jnp.abs(x)))
    far = jnp.where(x > 0.0, jnp.sin(root), jnp.sinh(jnp.minimum(root, 300.0))) / root
    return jnp.where(small, 1.0 - x * (1 / 6 - x * (1 / 120 - x / 5040)), far)


class LinearGear(NamedTuple):
    """What answers a force: m ÿ + c ẏ + k y.

    Attributes:
        mass: m [N·s²/mm].
        damping: c [N·s/mm].
        stiffness: k, of all steps or of each [N/mm].
    """

    mass: Scalar
    damping: Scalar
    stiffness: Scalar | Float[Array, " n-1"]


def decay_entries(
    gear: LinearGear, step: Float[Array, "*n"]
) -> tuple[Float[Array, "*n"], ...]:
    """Return the matrix that takes (y, ẏ) a time step [s] further without a force.

    Its four entries, row after row: exp(A h) = e^(−γh) (C 1 + S h (A + γ 1)),
    γ = c/2m, x = (k/m − γ²) h², C = cos √x, S = sin √x / √x: one formula through
    critical damping.
    """
    half, square = 0.5 * gear.damping / gear.mass, gear.stiffness / gear.mass
    x = (square - half**2) * step**2
    decay = jnp.exp(-half * step)
    level, slope = decay * _cosine(x), decay * _sine(x) * step
    return level + half * slope, slope, -square * slope, level - half * slope


def linear_response(
    gear: LinearGear,
    time: Float[Array, " n"],
    force: Float[Array, " n"],
    start: Float[Array, "2"],
) -> Float[Array, "n 2"]:
    """Return deformation [mm] and speed [mm/s] at the rows.

    Args:
        gear: that answers.
        time: increasing, in steps of any size [s].
        force: at the rows [N], linear between them.
        start: deformation and speed at the first row.
    """
    if len(time) > 2 * _STRETCH:
        return _in_stretches(gear, time, force, start)
    return jnp.concatenate([start[None], _advance(gear, time, force, start)])


def _advance(gear: LinearGear, time, force, start) -> Float[Array, "n-1 2"]:
    """Return the states at all rows but the first."""
    step, stiffness = jnp.diff(time), gear.stiffness
    slope = jnp.diff(force) / step
    lag = gear.damping * slope / stiffness**2
    before = jnp.stack([force[:-1] / stiffness - lag, slope / stiffness], axis=-1)
    after = jnp.stack([force[1:] / stiffness - lag, slope / stiffness], axis=-1)
    entries = decay_entries(gear, step)
    matrix = jnp.stack(entries, axis=-1).reshape(-1, 2, 2)
    gain = after - jnp.einsum("nij,nj->ni", matrix, before)
    return _follow(matrix, gain, start)


def _in_stretches(gear: LinearGear, time, force, start) -> Float[Array, "n 2"]:
    """Return all states, stretch after stretch; a gradient computes each anew.

    Of the record only the states are kept for a gradient, where otherwise some thirty
    numbers per row would be.
    """
    steps = len(time) - 1
    count = -(-steps // _STRETCH)
    spare = count * _STRETCH - steps
    stiffness = jnp.broadcast_to(gear.stiffness, steps)
    stiffness = jnp.pad(stiffness, (0, spare), mode="edge")
    beyond = jnp.arange(1, spare + 1) * (time[-1] - time[-2])
    time = jnp.concatenate([time, time[-1] + beyond])
    force = jnp.pad(force, (0, spare), mode="edge")
    rows = jnp.arange(count)[:, None] * _STRETCH + jnp.arange(_STRETCH + 1)

    @jax.checkpoint
    def stretch(state, part):
        stiffness, time, force = part
        here = gear._replace(stiffness=stiffness)
        states = _advance(here, time, force, state)
        return states[-1], states

    parts = stiffness.reshape(count, _STRETCH), time[rows], force[rows]
    _, states = jax.lax.scan(stretch, start, parts)
    return jnp.concatenate([start[None], states.reshape(-1, 2)[:steps]])


def _follow(
    matrix: Float[Array, "n 2 2"], gain: Float[Array, "n 2"], start: Float[Array, "2"]
) -> Float[Array, "n 2"]:
    """Return x_i = M_i x_(i−1) + g_i for all rows.

    In about √n stretches side by side, then from stretch to stretch: 2√n steps in
    sequence, where row by row it would be n.
    """
    rows = len(gain)
    length = max(math.isqrt(rows), 1)
    count = -(-rows // length)
    # Rows that change nothing fill up the last stretch.
    spare = count * length - rows
    matrix = jnp.concatenate([matrix, jnp.broadcast_to(jnp.eye(2), (spare, 2, 2))])
    gain = jnp.concatenate([gain, jnp.zeros((spare, 2))])
    by_place = (
        matrix.reshape(count, length, 2, 2).swapaxes(0, 1),
        gain.reshape(count, length, 2).swapaxes(0, 1),
    )

    def apply(m, x):
        return jnp.sum(m * x[..., None, :], axis=-1)

    def within(so_far, row):
        product, driven = so_far
        m, g = row
        turned = jnp.sum(m[..., :, :, None] * product[..., None, :, :], axis=-2)
        so_far = turned, apply(m, driven) + g
        return so_far, so_far

    still = jnp.broadcast_to(jnp.eye(2), (count, 2, 2)), jnp.zeros((count, 2))
    _, (product, driven) = jax.lax.scan(within, still, by_place)

    def between(state, stretch):
        m, g = stretch
        return apply(m, state) + g, state

    _, first = jax.lax.scan(between, start, (product[-1], driven[-1]))
    states = apply(product, first[None]) + driven
    return states.swapaxes(0, 1).reshape(count * length, 2)[:rows]
