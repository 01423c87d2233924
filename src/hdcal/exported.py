"""`jit` of JAX."""

from jax import jit as jit
