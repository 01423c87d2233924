"""Compiled functions that start fast: what was traced once is kept on disk.

A program is `jax.jit` of a function of a module. Where JAX' compilation cache has a
folder, what tracing makes of the function is kept there too, as `jax.export` writes it,
for each kind of arguments: structure, shapes and types. A later process reads that
instead of tracing anew, and imports none of what only tracing needs.
"""

import hashlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, update_wrapper
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import export
from jax.core import Tracer

# Versions of the code whose programs stay beside each other in one cache.
_VERSIONS_KEPT = 4
# Libraries of which a trace has code.
_TRACED = ("jax", "jaxlib", "numpyro", "equinox", "diffrax", "optimistix", "lineax")
# Whose classes may be in it: their code, or version, is in its name.
_KNOWN = {*_TRACED, "hdcal", "builtins", "collections", "numpy"}
_CODE = Path(__file__).parent
_DIGEST_SIZE = hashlib.sha256().digest_size
# Nobody else may write what is run.
_OWN, _OTHERS_WRITE = 0o700, 0o022


class _Kind(NamedTuple):
    """What a program hangs on beside the code, and where such programs are kept."""

    structure: Any
    fixed: tuple
    arrays: tuple
    double: bool
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
        fixed = {name: named.pop(name) for name in self._static}
        leaves, structure = jax.tree.flatten((args, named))
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            return self._jitted(*args, **named, **fixed)
        leaves = [x if isinstance(x, jax.Array) else np.asarray(x) for x in leaves]
        kind = _Kind(
            structure,
            tuple(fixed.items()),
            tuple((leaf.shape, leaf.dtype) for leaf in leaves),
            jax.config.read("jax_enable_x64"),
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
            found = self._function(*args, **named, **dict(kind.fixed))
            return found if self._returns is None else jax.tree.leaves(found)

        file = self._file(kind)
        exported = None if file is None else _read(file)
        if exported is None and file is not None:
            # What calls back into this process, say, cannot be kept.
            with suppress(Exception):
                exported = export.export(jax.jit(flat))(*leaves)
                _write(file, bytes(exported.serialize()))
        return jax.jit(flat if exported is None else exported.call)

    def _file(self, kind: _Kind) -> Path | None:
        """Return where the program is kept; None where it cannot be."""
        name = f"{self.__module__}.{self._function.__qualname__}"
        settings = sorted(item for item in jax.config.values.items() if _matters(item))
        told = repr((name, *kind[:-1], settings, jax.default_backend()))
        # What is told by its place in this process' memory is no name elsewhere.
        if kind.folder is None or " at 0x" in told or _is_foreign(kind):
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


def _matters(setting: tuple[str, Any]) -> bool:
    """Tell whether a setting of JAX may be in a trace: where things are kept is not."""
    return "cache" not in setting[0]


def _is_foreign(kind: _Kind) -> bool:
    """Tell whether a trace has code of classes that no digest is of: a user's own."""
    classes = {*_classes_of(kind.structure), *_classes_in(kind.fixed)}
    return any(one.__module__.partition(".")[0] not in _KNOWN for one in classes)


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
