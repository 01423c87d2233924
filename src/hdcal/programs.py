"""Compiled functions that start fast: what was traced once is kept on disk.

A program is `jax.jit` of a function of a module. Where JAX' compilation cache has a
folder, what tracing makes of the function is kept there too, as `jax.export` writes it,
for each kind of arguments: structure, shapes and types. A later process reads that
instead of tracing anew, and imports none of what only tracing needs.
"""

import builtins
import hashlib
import os
import secrets
import shutil
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial, update_wrapper
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import export
from jax.core import Tracer
from jax.extend.core import get_opaque_trace_state

# Versions of the code whose programs stay beside each other in one cache.
_VERSIONS_KEPT = 4
# Libraries of which a trace has code.
_TRACED = ("jax", "jaxlib", "numpyro", "equinox", "diffrax", "optimistix", "lineax")
# Whose classes may be in it: their code, or version, is in its name.
_KNOWN = {*_TRACED, "hdcal", "collections", "numpy"}
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
_CODE = Path(__file__).parent
_DIGEST_SIZE = hashlib.sha256().digest_size
# NumPyro's handlers are on one stack, whatever the thread: only one may trace.
_TRACING = threading.RLock()
# Which trace is under way, and none: inside of another one a program is part of it.
_trace_state = partial(get_opaque_trace_state, convention="flax")
_NO_TRACE = _trace_state()
# Nobody else may write what is run.
_OWN, _OTHERS_WRITE = 0o700, 0o022


class _Kind(NamedTuple):
    """What a program hangs on beside the code, and where such programs are kept."""

    structure: Any
    fixed: tuple
    arrays: tuple
    settings: tuple
    folder: Path | None


class Program:
    """A function as `jax.jit` makes it, whose trace is kept.

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
        if any(map(_is_placed, leaves)) or _trace_state() != _NO_TRACE:
            return self._jitted(*args, **named, **fixed)
        leaves = [x if isinstance(x, jax.Array) else np.asarray(x) for x in leaves]
        kind = _Kind(
            structure,
            tuple((name, type(value), value) for name, value in fixed.items()),
            tuple((leaf.shape, leaf.dtype) for leaf in leaves),
            tuple(getattr(jax.config, name) for name in _SETTINGS),
            _folder(_cached()),
        )
        if kind not in self._ready:
            self._ready[kind] = self._made(kind, leaves)
        found = self._ready[kind](*leaves)
        return found if self._returns is None else self._returns(*found)

    def clear_cache(self) -> None:
        """Release what was compiled."""
        for one in (self._jitted, *self._ready.values()):
            one.clear_cache()
        self._ready.clear()

    def _made(self, kind: _Kind, leaves: Sequence) -> Callable:
        """Return the program for one kind of arguments, as it was kept if it was."""

        def flat(*leaves):
            args, named = jax.tree.unflatten(kind.structure, leaves)
            fixed = {name: value for name, _, value in kind.fixed}
            found = self._function(*args, **named, **fixed)
            return found if self._returns is None else jax.tree.leaves(found)

        flat = _named(flat, self._function.__name__)
        file = self._file(kind)
        exported = None if file is None else _read(file)
        if exported is None and file is not None:
            # What calls back into this process, say, cannot be kept.
            with suppress(Exception), _TRACING:
                kept = bytes(export.export(jax.jit(flat))(*leaves).serialize())
                # As later processes have it: to the last bit the same.
                exported = export.deserialize(bytearray(kept))
                _write(file, kept)
        if exported is not None:
            call = _named(exported.call, self._function.__name__)
            return jax.jit(call, compiler_options=_options())
        ready = jax.jit(flat, compiler_options=_options())
        with _TRACING:
            ready.lower(*leaves)
        return ready

    def _file(self, kind: _Kind) -> Path | None:
        """Return where the program is kept; None where it cannot be."""
        name = f"{self.__module__}.{self._function.__qualname__}"
        told = repr((name, *kind[:-1], jax.default_backend()))
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
    """Return a function with a name by which logs and profiles tell it."""

    def named(*leaves):
        return function(*leaves)

    named.__name__ = name
    return named


def _is_placed(leaf: Any) -> bool:
    """Tell whether an argument is traced already, or bound to another device."""
    if isinstance(leaf, Tracer):
        return True
    return getattr(leaf, "committed", False) and leaf.devices() != {jax.devices()[0]}


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


def _cached() -> str | None:
    """Return the folder of JAX' compilation cache; None without one."""
    # Flags are put there at import time, out of pyright's sight.
    return jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]


def _read(file: Path) -> export.Exported | None:
    """Return what is kept; a file that is damaged is thrown away."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    digest, kept = content[:_DIGEST_SIZE], content[_DIGEST_SIZE:]
    with suppress(Exception):
        if hashlib.sha256(kept).digest() == digest:
            return export.deserialize(bytearray(kept))
    with suppress(OSError):
        file.unlink()
    return None


def _write(file: Path, kept: bytes) -> None:
    """Keep a program, whole or not at all; a full disk keeps none."""
    part = file.with_suffix(f".{secrets.token_hex(4)}")
    with suppress(OSError):
        try:
            part.write_bytes(hashlib.sha256(kept).digest() + kept)
            os.replace(part, file)
        finally:
            part.unlink(missing_ok=True)


@cache
def _folder(cached: str | None) -> Path | None:
    """Return the folder of this code's programs in a cache; None where none can be."""
    if not cached:
        return None
    whole = Path(cached) / "programs"
    try:
        folder = whole / _of_code()
        for one in (whole, folder):
            one.mkdir(_OWN, parents=True, exist_ok=True)
            held = one.stat()
            if held.st_mode & _OTHERS_WRITE or held.st_uid != os.getuid():
                return None
        os.utime(folder)
        older = sorted(whole.iterdir(), key=lambda one: one.stat().st_mtime)
        for one in older[:-_VERSIONS_KEPT]:
            shutil.rmtree(one, ignore_errors=True)
    except OSError:
        return None
    return folder


def _of_code() -> str:
    """Return a digest of all code that a trace may have."""
    whole = hashlib.sha256()
    for file in sorted(_CODE.rglob("*.py")):
        whole.update(str(file.relative_to(_CODE)).encode() + file.read_bytes())
    for name in _TRACED:
        with suppress(PackageNotFoundError):
            whole.update(f"{name} {version(name)}".encode())
    return whole.hexdigest()[:32]
