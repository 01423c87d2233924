"""`jax.jit` that caches traced programs across processes, by `jax.export`.

Tracing and lowering the programs of a calibration takes longer than running them.
Where JAX has a folder for its compilation cache, lowered programs are cached there, and
a later process loads them. Otherwise, and under a transformation, `jit` is `jax.jit`.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache, partial, update_wrapper
from importlib import metadata
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

# Settings that a trace depends on.
_TRACE_SETTINGS = (
    "jax_enable_x64",
    "jax_threefry_partitionable",
    "jax_default_prng_impl",
    "jax_default_matmul_precision",
)
# Packages whose code may be part of a trace; the digest holds their versions.
_TRACED = ("jax", "jaxlib", "numpy", "numpyro", "equinox", "diffrax", "optimistix")


class _NotCacheable(Exception):
    """A class whose code the digest does not cover, such as an effect of the user."""


def jit(
    function: Callable | None = None, *, static_argnames: tuple[str, ...] = ()
) -> Any:
    """Return a compiled function; serves as a decorator like `jax.jit`.

    Args:
        function: module-level; arguments and results are pytrees of arrays.
        static_argnames: keyword arguments that are not arrays.
    """
    if function is None:
        return partial(jit, static_argnames=static_argnames)
    return _CachedJit(function, static_argnames)


class _CachedJit:
    def __init__(self, function: Callable, static: tuple[str, ...]):
        update_wrapper(self, function)
        self._function, self._static = function, static
        self._jitted: Any = jax.jit(function, static_argnames=static)
        self._loaded: dict[Any, Callable | None] = {}

    def __call__(self, *args, **named):
        static = {name: named.pop(name) for name in self._static if name in named}
        leaves, structure = jax.tree.flatten((args, named))
        folder = _setting("jax_compilation_cache_dir")
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            # Within another program: a trace that JAX kept for itself would outlive
            # the code that it was made of.
            return self._function(*args, **named, **static)
        if folder is None or _needs_plain_jit():
            return self._jitted(*args, **named, **static)
        leaves = [x if isinstance(x, jax.Array) else np.asarray(x) for x in leaves]
        shapes = tuple(
            (leaf.shape, str(leaf.dtype), getattr(leaf, "weak_type", False))
            for leaf in leaves
        )
        settings = [jax.default_backend(), os.environ.get("EQX_ON_ERROR")]
        settings += map(_setting, _TRACE_SETTINGS)
        kind = structure, tuple(static.items()), shapes, tuple(settings)
        if kind not in self._loaded:
            self._loaded[kind] = self._load(Path(folder), kind, leaves)
        loaded = self._loaded[kind]
        if loaded is None:
            return self._jitted(*args, **named, **static)
        return loaded(*leaves)

    def _load(self, folder: Path, kind: tuple, leaves: list) -> Callable | None:
        """Load the cached program, or trace and cache it; None if it cannot be."""
        structure, static, *rest = kind

        def flat(*leaves):
            args, named = jax.tree.unflatten(structure, leaves)
            return self._function(*args, **named, **dict(static))

        flat.__name__ = self._function.__name__
        try:
            parts = self.__module__, flat.__name__, _outline(structure), _text(static)
        except _NotCacheable:
            return None
        text = repr((parts, *rest))
        file = folder / f"export-{_code()}" / hashlib.sha256(text.encode()).hexdigest()
        with suppress(Exception):
            content: Any = bytearray(file.read_bytes())
            return jax.jit(jax.export.deserialize(content).call)
        try:
            exported = jax.export.export(jax.jit(flat))(*leaves)
            content = exported.serialize()
        except (ValueError, NotImplementedError):
            # Such as a result that holds classes, or a call back into Python.
            return None
        with suppress(OSError):
            _write(file, content)
        return jax.jit(exported.call)


def _setting(name: str) -> Any:
    # `jax.config.read` rejects options that a context manager may override.
    return getattr(jax.config, name)


def _needs_plain_jit() -> bool:
    """Return whether a debugging mode needs `jax.jit` itself."""
    return any(map(_setting, ("jax_disable_jit", "jax_debug_nans", "jax_debug_infs")))


def _write(file: Path, content: bytes | bytearray) -> None:
    """Write a file, whole or not at all."""
    file.parent.mkdir(0o700, parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=file.parent) as part:
        (Path(part) / file.name).write_bytes(content)
        os.replace(Path(part) / file.name, file)


@cache
def _code() -> str:
    """Return a digest of the code that a trace may hold."""
    whole = hashlib.sha256()
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        whole.update(file.read_bytes())
    for name in _TRACED:
        whole.update(metadata.version(name).encode())
    return whole.hexdigest()[:16]


def _outline(structure: Any) -> str:
    """Return the structure of a pytree as text, the same in every process."""
    node = structure.node_data()
    if node is None:
        return "*"
    inner = ",".join(map(_outline, structure.children()))
    return f"{_text(node[0])}:{_text(node[1])}({inner})"


def _text(value: Any) -> str:
    """Return a value that is not an array as text.

    Raises:
        _NotCacheable: the value is a class, or an instance of one, of other packages.
    """
    if isinstance(value, tuple | list):
        return f"({','.join(map(_text, value))})"
    if isinstance(value, set | frozenset):
        return f"{{{','.join(sorted(map(_text, value)))}}}"
    if isinstance(value, Mapping):
        return _text(sorted(value.items()))
    kind = value if isinstance(value, type) else type(value)
    if kind.__module__.partition(".")[0] not in ("builtins", "hdcal", *_TRACED):
        raise _NotCacheable
    return f"{kind.__module__}.{kind.__qualname__}" if kind is value else repr(value)
