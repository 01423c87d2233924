"""How probable a reading is, given its mean and noise, rounding included."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc as jax_erfc
from jax.scipy.special import logsumexp
from jaxtyping import Float
from scipy import special

from hdcal.data.records import Array
from hdcal.physics.effect import Noise

# Further out the cube of Φ, in second derivatives, would come near what underflows; the
# series is off by 4e-9 at most.
_FAR = -20.0


def log_interval(low, high):
    """Return log(Φ(high) − Φ(low)) without cancellation in either tail.

    By NumPy for NumPy's arrays, whose shapes are many: nothing is compiled.
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


def log_probability(
    force: Float[Array, " n"],
    mean: Float[Array, " n"],
    noise: Noise,
    step: float | Float[Array, ""],
    *,
    rounded: bool,
) -> Float[Array, " n"]:
    """Return the log probability of each reading.

    Args:
        force: as read [N].
        mean: expected reading [N].
        noise: mixture of normals before rounding [N].
        step: rounding step q of the reading [N].
        rounded: whether a reading y stands for the interval y ± q/2 (then the
            result is a probability divided by q, so that it stays a density in N)
            or for the number itself.
    """
    error = (force - mean) / noise.sd
    if rounded:
        half = 0.5 * step / noise.sd
        each = log_interval(error - half, error + half) - jnp.log(step)
    else:
        each = -0.5 * (error**2 + jnp.log(2.0 * jnp.pi)) - jnp.log(noise.sd)
    return logsumexp(each + noise.log_weight[:, None], axis=0)


def row_precision(error: Float[Array, " n"], noise: Noise) -> Float[Array, " n"]:
    """Return the precision that each row has, as narrow a component as it is of [1/N²].

    Args:
        error: reading less its mean [N].
        noise: mixture of normals.
    """
    log_share = noise.log_weight[:, None] - 0.5 * (error / noise.sd) ** 2
    share = jax.nn.softmax(log_share - jnp.log(noise.sd), axis=0)
    return jnp.sum(share / noise.sd**2, axis=0)
