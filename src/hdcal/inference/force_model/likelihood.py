"""Likelihood of the readings of a problem."""

from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc as jax_erfc
from jax.scipy.special import logsumexp
from jaxtyping import Float
from scipy import special

from hdcal.data.records import Array, Records
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.force_model.values import predict_rows, with_rounding
from hdcal.inference.sampled_problem import Sampled, Values
from hdcal.physics.effect import Noise

if TYPE_CHECKING:
    from hdcal.inference.force_model.problem import Problem

# Further out the cube of Φ, in second derivatives, would come near what underflows; the
# series is off by 4e-9 at most.
_FAR = -20.0


def log_interval(low, high):
    """Return log(Φ(high) − Φ(low)) without cancellation in either tail.

    NumPy arrays, which have many shapes, are computed by NumPy: nothing is compiled.
    """
    xp, erfc = (np, special.erfc) if isinstance(low, np.ndarray) else (jnp, jax_erfc)
    flip = low > 0.0
    low, high = xp.where(flip, -high, low), xp.where(flip, -low, high)
    # One call: to trace and compile it takes longer than to run it.
    ends = xp.stack([high, low])
    near, far = xp.maximum(ends, _FAR), xp.minimum(ends, _FAR)
    inside, small = 0.5 * erfc(-np.sqrt(0.5) * near), 1.0 / far**2
    series = 1.0 - small * (1.0 - 3.0 * small * (1.0 - 5.0 * small))
    outside = -np.sqrt(0.5 / np.pi) * series / far
    # Φ as a factor times e to a power: the difference takes one logarithm, no more.
    factor = xp.where(ends < _FAR, outside, inside)
    power = xp.where(ends < _FAR, -0.5 * far**2, 0.0)
    return power[0] + xp.log(factor[0] - factor[1] * xp.exp(power[1] - power[0]))


def log_probability(force, mean, noise: Noise, step, *, rounded: bool):
    """Return the log probability of each reading [log 1/N], shape (n,).

    The noise is a mixture of normals before rounding. Where `rounded`, a reading y
    stands for the interval y ± step/2, whose probability is divided by the step.
    """
    error = (force - mean) / noise.sd
    if rounded:
        half = 0.5 * step / noise.sd
        each = log_interval(error - half, error + half) - jnp.log(step)
    else:
        each = -0.5 * (error**2 + jnp.log(2.0 * jnp.pi)) - jnp.log(noise.sd)
    return logsumexp(each + noise.log_weight[:, None], axis=0)


def row_precision(error: Float[Array, " n"], noise: Noise) -> Float[Array, " n"]:
    """Return the precision of each row [1/N²], averaged over the mixture."""
    log_share = noise.log_weight[:, None] - 0.5 * (error / noise.sd) ** 2
    share = jax.nn.softmax(log_share - jnp.log(noise.sd), axis=0)
    return jnp.sum(share / noise.sd**2, axis=0)


def pointwise_log_likelihood(
    problem: "Problem", values: Values, records: Records, columns, before
) -> Float[Array, " n"]:
    """Return the log likelihood of each row given all values [log 1/N].

    And given the rows before it in its run, where neighbours may be correlated.
    """
    mean, noise = predict_rows(problem, values, records, columns)
    noise = with_rounding(noise, problem.step, rounded=problem.rounded)
    if problem.correlated:
        # Mean and sd of each row given the row before it.
        (sd,), rho = noise.sd, jnp.where(before >= 0, values[CORRELATION], 0.0)
        mean = mean + sd * rho * ((records.force - mean) / sd)[before]
        noise = Noise(noise.log_weight, (sd * jnp.sqrt(1.0 - rho**2))[None])
    return log_probability(
        records.force, mean, noise, problem.step, rounded=problem.rounded
    )


@jax.jit
def log_likelihoods(problem: Sampled, draws: Values) -> Float[Array, "chain draw"]:
    """Return the log likelihood of all data by draw."""

    def of_draw(values):
        return problem.log_likelihood(values)

    # One draw after the other: all rows of thousands of draws would fill the memory.
    return jax.vmap(partial(jax.lax.map, of_draw))(draws)
