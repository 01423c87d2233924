"""Recurrences over ordered rows, shared by the effects that remember."""

import jax
from jaxtyping import Array, Float


def leaky_sum(
    decay: Float[Array, " n"], gain: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Return y_i = decay_i · y_(i−1) + gain_i with y before the first row zero.

    A decay of zero restarts the sum. Composed as an associative scan, whose depth
    is log n instead of n.
    """

    def compose(first, second):
        return first[0] * second[0], second[0] * first[1] + second[1]

    return jax.lax.associative_scan(compose, (decay, gain))[1]
