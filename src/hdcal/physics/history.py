"""Recurrences over ordered rows, shared by the effects that remember."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.rig.records import Array


def leaky_sum(
    decay: Float[Array, " n"], gain: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Return y_i = decay_i · y_(i−1) + gain_i with y before the first row zero.

    A decay of zero restarts the sum.
    """

    def advance(last, row):
        now = row[0] * last + row[1]
        return now, now

    return jax.lax.scan(advance, jnp.zeros(()), (decay, gain))[1]
