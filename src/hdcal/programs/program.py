"""Compiled functions that start fast: what was compiled once is kept on disk.

A program is `jax.jit` of a function of a module. Where there is a folder for it, what
was compiled is kept, as the device runs it, for each kind of arguments: structure,
shapes and types. A later process loads that, where with JAX' own cache it had to trace
and lower the function to find out what to load; it imports none of what only tracing
needs.
"""

import builtins
import hashlib
import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import update_wrapper
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.core import Tracer

from hdcal.programs import ahead
from hdcal.programs.compiling import computing_device, is_tracing, lowered, to_keep
from hdcal.programs.files import TRACED, folder, read, write

# Whose classes may be in it: their code, or version, is in its name.
_KNOWN = {*TRACED, "hdcal", "collections", "numpy"}
# Settings of JAX that change what is traced; the last one is a device.
_SETTINGS = (
    "jax_enable_x64",
    "jax_default_matmul_precision",
    "jax_numpy_dtype_promotion",
    "jax_default_prng_impl",
    "jax_threefry_partitionable",
    "jax_debug_nans",
    "jax_default_device",
)
# NumPyro's handlers are on one stack, whatever the thread: only one may trace.
_TRACING = threading.RLock()


class _Kind(NamedTuple):
    """What a program hangs on beside the code, and where such programs are kept."""

    structure: Any
    fixed: tuple
    arrays: tuple
    settings: tuple
    device: Any
    folder: Path | None


class Program:
    """A function as `jax.jit` makes it, which is kept as it was compiled.

    Under a transformation (a gradient, another program) it is `jax.jit` and no more.
    Numbers among the arguments are taken as arrays.
    """

    def __init__(
        self,
        function: Callable,
        static: Sequence[str] = (),
        returns: Callable | None = None,
    ):
        update_wrapper(self, function)
        self._function, self._static = function, tuple(static)
        self._returns = returns
        self._jitted: Any = jax.jit(function, static_argnames=self._static or None)
        self._ready: dict[_Kind, Any] = {}

    def __call__(self, *args, **named):
        """Return what the function returns; static arguments are named."""
        fixed = {name: named.pop(name) for name in self._static if name in named}
        leaves, structure = jax.tree.flatten((args, named))
        device = computing_device()
        placed = any(_is_placed(leaf, device) for leaf in leaves)
        # Inside of another trace a program is part of it.
        if placed or is_tracing() or _is_debugged():
            return self._jitted(*args, **named, **fixed)
        leaves = [x if isinstance(x, jax.Array) else np.asarray(x) for x in leaves]
        kind = _Kind(
            structure,
            tuple((name, type(value), value) for name, value in fixed.items()),
            tuple((leaf.shape, leaf.dtype) for leaf in leaves),
            (
                os.environ.get("EQX_ON_ERROR"),
                os.environ.get("XLA_FLAGS"),
                *(getattr(jax.config, name) for name in _SETTINGS),
            ),
            device,
            folder(),
        )
        if kind not in self._ready:
            self._ready[kind] = self._made(kind, leaves)
        found = self._ready[kind](*leaves)
        return found if self._returns is None else self._returns(*found)

    def clear_cache(self) -> None:
        """Release what was compiled."""
        self._jitted.clear_cache()
        self._ready.clear()

    def _made(self, kind: _Kind, leaves: Sequence) -> Callable:
        """Return the program for one kind of arguments, as it was kept if it was."""

        def flat(*leaves):
            args, named = jax.tree.unflatten(kind.structure, leaves)
            fixed = {name: value for name, _, value in kind.fixed}
            found = self._function(*args, **named, **fixed)
            return found if self._returns is None else jax.tree.leaves(found)

        name, file = self._function.__name__, self._file(kind)
        if file is not None and (ready := ahead.called(file, name)) is not None:
            return ready
        if file is not None and (ready := read(file)) is not None:
            return ready
        with _TRACING:
            found = lowered(flat, name, leaves)
        compiled = found.compile()
        # What cannot be kept is traced anew.
        with suppress(Exception):
            if file is not None and (kept := to_keep(found, compiled)) is not None:
                write(file, kept)
        return compiled

    def _file(self, kind: _Kind) -> Path | None:
        """Return where the program is kept; None where it cannot be."""
        name = f"{self.__module__}.{self._function.__qualname__}"
        held = _text(kind.fixed), kind.arrays, kind.settings, kind.device.device_kind
        told = repr((name, _outline(kind.structure), *held))
        # A function that another one made, or what is told by its place in this
        # process' memory, has no name elsewhere.
        nameless = "<" in name or " at 0x" in told
        on_another = kind.settings[-1] is not None
        if kind.folder is None or nameless or on_another or _is_foreign(kind):
            return None
        return kind.folder / hashlib.sha256(told.encode()).hexdigest()


def program(
    function: Callable | None = None,
    *,
    static: Sequence[str] = (),
    returns: Callable | None = None,
) -> Any:
    """Return a function as a program; serves as a decorator.

    Args:
        function: of arrays, and of trees of them, that tracing can follow.
        static: names of arguments that are no arrays.
        returns: class of what is returned, where that is one of arrays only and no
            dict, list or tuple.
    """
    if function is None:
        return lambda function: Program(function, static, returns)
    return Program(function, static, returns)


def _is_debugged() -> bool:
    """Return whether JAX is to do otherwise than compile for its own device."""
    asked = "disable_jit", "debug_nans", "debug_infs", "default_device"
    return any(getattr(jax.config, f"jax_{name}") for name in asked)


def _outline(structure: Any) -> str:
    """Return a structure as text, the same in every process."""
    node = structure.node_data()
    if node is None:
        return "*"
    inner = ",".join(map(_outline, structure.children()))
    return f"{node[0].__module__}.{node[0].__qualname__}:{_text(node[1])}({inner})"


def _text(held: Any) -> str:
    """Return what is no array as text; the order in a set is that of the process."""
    if isinstance(held, set | frozenset):
        return f"{{{','.join(sorted(map(_text, held)))}}}"
    if isinstance(held, tuple | list):
        return f"({','.join(map(_text, held))})"
    return repr(held)


def _is_placed(leaf: Any, device: Any) -> bool:
    """Tell whether an argument is traced already, or bound to another device."""
    if isinstance(leaf, Tracer):
        return True
    return getattr(leaf, "committed", False) and leaf.devices() != {device}


def _is_foreign(kind: _Kind) -> bool:
    """Tell whether a trace has code of classes that no digest is of: a user's own."""
    classes = {*_classes_of(kind.structure), *_classes_in(kind.fixed)}
    return not all(map(_is_known, classes))


def _is_known(one: type) -> bool:
    # What text that was executed defines is said to be built in.
    if one.__module__ == "builtins":
        return getattr(builtins, one.__name__, None) is one or one is type(None)
    return one.__module__.partition(".")[0] in _KNOWN


def _classes_of(structure: Any) -> Iterator[type]:
    node = structure.node_data()
    if node is not None:
        yield node[0]
        yield from _classes_in(node[1])
    for child in structure.children():
        yield from _classes_of(child)


def _classes_in(held: Any) -> Iterator[type]:
    """Yield the classes in what is no array: themselves, and those of instances."""
    if isinstance(held, type):
        yield held
    elif isinstance(held, tuple | list | set | frozenset):
        for one in held:
            yield from _classes_in(one)
    elif isinstance(held, Mapping):
        yield from _classes_in([*held.items()])
    else:
        yield type(held)
