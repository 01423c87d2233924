"""Readings drawn from their mean and noise."""

import jax
import jax.numpy as jnp


def draw_reading(key, mean, noise, step=0.0):
    """Draw a reading of each row, rounded to `step` when it is positive [N]."""
    pick, normal = jax.random.split(key)
    component = jax.random.categorical(pick, noise.log_weight, shape=mean.shape)
    sd = jnp.take_along_axis(noise.sd, component[None], axis=0)[0]
    reading = mean + sd * jax.random.normal(normal, mean.shape)
    unit = jnp.where(step > 0.0, step, 1.0)
    return jnp.where(step > 0.0, unit * jnp.round(reading / unit), reading)
