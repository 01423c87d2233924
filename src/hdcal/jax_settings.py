"""Settings of JAX, set by the first `Geometry` or `Records`, not by importing hdcal."""

import os
from typing import Any

import jax
import jax.numpy as jnp
from jax.core import Tracer

from hdcal.errors import Finding, InputError, quoted

# XLA on CPUs compiles a loop that touches fewer bytes per iteration as one kernel.
_WHOLE_LOOPS = "xla_cpu_small_while_loop_byte_threshold=100000000"
_EXTRA = "xla_backend_extra_options"


def use_double_precision(made: Any) -> None:
    """Switch JAX to double precision and to compiling each small loop as one kernel.

    In single precision the error of a force, 1e-7 of it, exceeds the posterior sd at a
    million rows.

    Args:
        made: the pytree with which a computation begins.

    Raises:
        InputError: `JAX_PLATFORMS` names a device that is not available.
        RuntimeError: inside a function that JAX compiles or differentiates, whose
            arguments are in single precision already.
    """
    if jax.config.read("jax_enable_x64"):
        return
    _compile_loops_whole()
    if any(isinstance(x, Tracer) for x in (*jax.tree.leaves(made), _zero())):
        raise RuntimeError(
            f"a {type(made).__name__} switches JAX to double precision, which is too "
            "late inside a function that is compiled or differentiated: make one "
            'before, or call jax.config.update("jax_enable_x64", True)'
        )
    jax.config.update("jax_enable_x64", True)


def _zero() -> jax.Array:
    """Return an array, which is a tracer inside `jax.jit`."""
    try:
        return jnp.zeros(())
    except (RuntimeError, AssertionError):
        named = quoted(os.environ.get("JAX_PLATFORMS", ""))
        words = f"names {named}, which JAX cannot use here"
        remedy = "Unset it, or name an available device, such as cpu"
        raise InputError([Finding("JAX_PLATFORMS", words, remedy)]) from None


def _compile_loops_whole() -> None:
    """Set the flag of XLA for whole loops, unless the user has set it.

    A step of the sampler is hundreds of operations on a few numbers, and starting a
    kernel for each takes two thirds of the time. XLA reads the environment once.
    """
    flags = os.environ.get("XLA_FLAGS", "").strip()
    # A value without a leading dash is a file of flags.
    if _EXTRA not in flags and flags[:1] in ("", "-"):
        os.environ["XLA_FLAGS"] = f"{flags} --{_EXTRA}={_WHOLE_LOOPS}".strip()
