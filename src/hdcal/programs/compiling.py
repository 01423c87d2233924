"""How functions are compiled, and where JAX keeps what came of it."""

from collections.abc import Callable
from functools import cache
from typing import Any

import jax


def jitted(function: Callable, name: str) -> Any:
    """Return a function as `jax.jit` makes it, with a name for logs and profiles."""
    return jax.jit(_named(function, name), compiler_options=_options())


def cache_folder() -> str | None:
    """Return the folder of JAX' compilation cache; None without one."""
    # Flags are put there at import time, out of pyright's sight.
    return jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]


@cache
def _options() -> dict[str, Any] | None:
    """Return with what XLA compiles faster, where it knows that.

    Measured: a first calibration takes a fifth less, a first diagnosis a tenth; those
    after it, and sampling itself, as long as before.
    """
    faster = {"xla_cpu_use_fusion_emitters": False}
    if jax.default_backend() != "cpu":
        return None
    try:
        jax.jit(_named(lambda x: x, "options"), compiler_options=faster)(0.0)
    except Exception:
        return None
    return faster


def _named(function: Callable, name: str) -> Callable:
    def named(*leaves):
        return function(*leaves)

    named.__name__ = name
    return named
