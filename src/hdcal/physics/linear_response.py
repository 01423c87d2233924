"""The exact response of the linear model to a force that is linear between rows.

m ÿ + c ẏ + k y = F(t). Between two rows the particular solution for F = F₀ + s τ is
y_p = (F₀ + s τ)/k − c s/k², and what is left over decays freely, in closed form: no
step size enters, and damping and time steps may be of any size.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.theory import Scalar

# Deformation [mm] and speed [mm/s]. Two numbers instead of an array, so that XLA fuses
# the operations of a row.
State = tuple[Scalar, Scalar]
# Below this |x| the functions of √x are summed as series, smooth through zero.
_SMALL = 1e-4


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
    """m ÿ + c ẏ + k y = F; k of all steps or of each [N, mm, s]."""

    mass: Scalar
    damping: Scalar
    stiffness: Scalar | Float[Array, " n-1"]


def _applied(matrix: tuple[Scalar, ...], state: State) -> State:
    """Return the product of a matrix, given row after row, and a state."""
    a, b, c, d = matrix
    return a * state[0] + b * state[1], c * state[0] + d * state[1]


def _steps(gear: LinearGear, time, force) -> tuple[tuple[Scalar, ...], State]:
    """Return matrix and gain of all steps: state ← matrix · state + gain.

    The matrix of the free motion of (y, ẏ), its entries row after row, is
    exp(A h) = e^(−γh) (C 1 + S h (A + γ 1)), γ = c/2m, x = (k/m − γ²) h², C = cos √x,
    S = sin √x / √x, valid through critical damping.
    """
    step = jnp.diff(time)
    half, square = 0.5 * gear.damping / gear.mass, gear.stiffness / gear.mass
    x = (square - half**2) * step**2
    decay = jnp.exp(-half * step)
    cosine, sine = decay * _cosine(x), decay * _sine(x) * step
    matrix = cosine + half * sine, sine, -square * sine, cosine - half * sine
    # The state that follows the force F₀ + s t without vibration.
    rate = jnp.diff(force) / step / gear.stiffness
    level = (force[:-1] - gear.damping * rate) / gear.stiffness
    kept = _applied(matrix, (level, rate))
    return matrix, (level + rate * step - kept[0], rate - kept[1])


def linear_response(
    gear: LinearGear,
    time: Float[Array, " n"],
    force: Float[Array, " n"],
    start: Float[Array, "2"],
) -> Float[Array, "n 2"]:
    """Return deformation [mm] and speed [mm/s] at the rows.

    Times [s] increase in steps of any size, the force [N] is linear between the rows,
    and `start` is deformation and speed at the first row.
    """

    # A gradient recomputes each step, which takes less memory than to keep it.
    @jax.checkpoint
    def advance(state, step):
        matrix, gain = step
        free = _applied(matrix, state)
        state = free[0] + gain[0], free[1] + gain[1]
        return state, jnp.stack(state)

    steps = _steps(gear, time, force)
    _, states = jax.lax.scan(advance, (start[0], start[1]), steps)
    return jnp.concatenate([start[None], states])


def fit_linear(
    place: Float[Array, "2"],
    time: Float[Array, " n"],
    force: Float[Array, " n"],
    read: Float[Array, " n"],
    weight: Float[Array, " n"],
    stiffness: Scalar | Float[Array, " n-1"],
) -> tuple[Float[Array, ""], Float[Array, "4"]]:
    """Return the residual sum of squares, and 1/k, y₀, ẏ₀ and offset of the best fit.

    At a given place, natural frequency [Hz] and damping ratio, the deformations [mm]
    that are read are linear in these. The force is linear between the rows, the weight
    of a row 0 or 1, and the stiffness of all steps, or of each, relative to its mean.
    """
    # A mass of one over ω² has a mean stiffness of one.
    pace = 2.0 * jnp.pi * place[0]
    gear = LinearGear(pace**-2, 2.0 * place[1] / pace, stiffness)
    forces = jnp.zeros((3, len(time))).at[0].set(force)
    starts = jnp.zeros((3, 2)).at[1, 0].set(1.0).at[2, 1].set(pace)
    moved = jax.vmap(linear_response, (None, None, 0, 0))
    columns = moved(gear, time, forces, starts)[..., 0]
    columns = weight * jnp.append(columns, jnp.ones((1, len(time))), axis=0)
    size = jnp.linalg.norm(columns, axis=1) + 1e-300
    design = columns / size[:, None]
    normal = design @ design.T + 1e-10 * jnp.eye(4)
    found = jnp.linalg.solve(normal, design @ (weight * read))
    left = weight * read - found @ design
    fitted = found / size * jnp.array([1.0, 1.0, pace, 1.0])
    # A gear gives way in the direction of the force.
    return jnp.where(fitted[0] > 0.0, left @ left, jnp.inf), fitted
