"""Keys of random numbers from a seed: all at once, since each step would compile."""

from functools import partial

import jax


@partial(jax.jit, static_argnames=("count",))
def key_array(seed: int, *, count: int):
    """Return so many keys, (count,)."""
    return jax.random.split(jax.random.key(seed), count)


@partial(jax.jit, static_argnames=("count",))
def separate_keys(seed: int, *, count: int):
    """Return the same keys, each an array of its own."""
    return [*jax.random.split(jax.random.key(seed), count)]
