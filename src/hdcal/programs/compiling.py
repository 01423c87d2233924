"""How functions are compiled, and what of that later processes can load."""

import os
import pickle
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import Any

import jax
from jax import numpy as jnp
from jax.extend.core import get_opaque_trace_state
from jax.sharding import SingleDeviceSharding

# Of XLA on CPUs: loops that touch fewer bytes a turn are one kernel each.
_WHOLE_LOOPS = "xla_cpu_small_while_loop_byte_threshold=100000000"
_EXTRA = "--xla_backend_extra_options"
# What code outside of XLA a program calls, and what of it other processes have.
_CALLED = re.compile(r'custom_call @"?([^"\s(]+)')
_LAPACK = "lapack_"
# Which trace is under way, and none.
_trace_state = partial(get_opaque_trace_state, convention="flax")
_NO_TRACE = _trace_state()


@cache
def compile_loops_whole() -> None:
    """Let XLA compile each loop as one piece, if it computes nothing yet.

    A step of a sampler is hundreds of operations on a few numbers each: to start a
    kernel for each operation takes two thirds of the time. No option of a program can
    say so, only the environment, which XLA reads once, when it begins. What the user
    has set stands.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    # Said too late it would only be part of the names under which programs are kept.
    # What begins otherwise names a file of flags.
    is_file = flags.strip() and not flags.lstrip().startswith("-")
    if _EXTRA not in flags and not is_file and not _has_begun():
        os.environ["XLA_FLAGS"] = f"{flags} {_EXTRA}={_WHOLE_LOOPS}".strip()


def _has_begun() -> bool:
    """Return whether XLA runs; where that cannot be told it may."""
    try:
        from jax._src.xla_bridge import backends_are_initialized
    except ImportError:
        return True
    return backends_are_initialized()


def computing_device() -> Any:
    """Return the device that programs run on: the processor, unless JAX is told.

    Beside an H200 a calibration took 35 times as long on it as on one core: each of
    thousands of small steps waits for the one before. `JAX_PLATFORMS` tells JAX
    otherwise; of several the first that is there counts.
    """
    asked = jax.config.jax_platforms  # pyright: ignore[reportAttributeAccessIssue]
    for name in (asked or "cpu").split(","):
        with suppress(RuntimeError):
            return jax.devices(name)[0]
    return jax.devices()[0]


def is_tracing() -> bool:
    """Return whether JAX traces, to compile or to differentiate."""
    return _trace_state() != _NO_TRACE


def lowered(function: Callable, name: str, arguments: Sequence) -> Any:
    """Return a function for such arguments, to be compiled.

    Compiled for shapes and types alone, it takes arrays that JAX has bound to their
    device, as those are that another one returned, and others: `jax.jit` would compile
    twice.

    Args:
        function: of arrays.
        name: for logs and profiles.
        arguments: arrays, or what has their shape and type.
    """
    # Told by what comes out as well: a program may use none of its arguments.
    options = {"compiler_options": _options(), "out_shardings": _elsewhere()}
    jitted: Any = jax.jit(_named(function, name), **options)
    return jitted.lower(*[_alike(a.shape, a.dtype) for a in arguments])


def _alike(shape: tuple[int, ...], dtype: Any) -> jax.ShapeDtypeStruct:
    """Return what stands for an array on the device that programs run on."""
    return jax.ShapeDtypeStruct(shape, dtype, sharding=_elsewhere())


def _elsewhere() -> SingleDeviceSharding | None:
    """Return where programs run, None where JAX would run them: bound to no device."""
    device = computing_device()
    return None if device == jax.devices()[0] else SingleDeviceSharding(device)


def to_keep(program: Any, compiled: Any) -> bytes | None:
    """Return what a later process loads; None where only this one can run it.

    Args:
        program: what `lowered` returned.
        compiled: what came of it.
    """
    called = set(_CALLED.findall(program.as_text()))
    if not all(name.startswith(_LAPACK) for name in called):
        # A function of Python, say, is known by where it lies in memory.
        return None
    from jax.experimental.serialize_executable import serialize

    return pickle.dumps((bool(called), serialize(compiled)))


def loaded(kept: bytes) -> Callable:
    """Return a function of which `to_keep` made the bytes.

    It is machine code, like all that JAX' cache holds: a file that others could have
    written must never come here.
    """
    from jax.experimental.serialize_executable import deserialize_and_load

    needs_lapack, executable = pickle.loads(kept)
    if needs_lapack:
        _find_lapack()
    return deserialize_and_load(*executable, execution_devices=[computing_device()])


@cache
def _find_lapack() -> None:
    """Let JAX look for LAPACK, which it does when it lowers what needs it."""
    jax.jit(jnp.linalg.cholesky).lower(_alike((1, 1), jnp.float32))


@cache
def _options() -> dict[str, Any] | None:
    """Return with what XLA compiles faster, where it knows that.

    Measured: a first calibration takes a fifth less, a first diagnosis a tenth; those
    after it, and sampling itself, as long as before.
    """
    faster = {"xla_cpu_use_fusion_emitters": False}
    if computing_device().platform != "cpu":
        return None
    try:
        same = jax.jit(_named(lambda x: x, "options"), compiler_options=faster)
        same.lower(_alike((), jnp.float32)).compile()
    except Exception:
        return None
    return faster


def _named(function: Callable, name: str) -> Callable:
    def named(*leaves):
        return function(*leaves)

    named.__name__ = name
    return named
