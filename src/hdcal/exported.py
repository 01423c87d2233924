"""`jax.jit` that keeps its traces between processes, by `jax.export`.

To trace and lower the programs of a calibration takes Python longer than to run them.
Where JAX has a folder for its compilation cache, what was lowered is kept there, and a
later process loads it. Otherwise, and under a transformation, `jit` is `jax.jit`.
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

# Packages whose code may be part of a trace; the digest holds their versions.
_TRACED = ("jax", "jaxlib", "numpy", "numpyro", "equinox", "diffrax", "optimistix")


class _Foreign(Exception):
    """A class of which the digest holds no code, such as an effect of the user."""


def jit(
    function: Callable | None = None, *, static_argnames: tuple[str, ...] = ()
) -> Any:
    """Return a compiled function; serves as a decorator like `jax.jit`.

    Args:
        function: of a module, of pytrees of arrays.
        static_argnames: keyword arguments that are no arrays.
    """
    if function is None:
        return partial(jit, static_argnames=static_argnames)
    return _Exported(function, static_argnames)


class _Exported:
    def __init__(self, function: Callable, static: tuple[str, ...]):
        update_wrapper(self, function)
        self._function, self._static = function, static
        self._jitted: Any = jax.jit(function, static_argnames=static)
        self._loaded: dict[Any, Callable | None] = {}

    def __call__(self, *args, **named):
        static = {name: named.pop(name) for name in self._static if name in named}
        leaves, structure = jax.tree.flatten((args, named))
        folder = _setting("jax_compilation_cache_dir")
        if folder is None or _is_special(leaves):
            return self._jitted(*args, **named, **static)
        leaves = [x if isinstance(x, jax.Array) else np.asarray(x) for x in leaves]
        shapes = tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
        kind = structure, tuple(static.items()), shapes
        if kind not in self._loaded:
            self._loaded[kind] = self._load(Path(folder), kind, leaves)
        loaded = self._loaded[kind]
        if loaded is None:
            return self._jitted(*args, **named, **static)
        return loaded(*leaves)

    def _load(self, folder: Path, kind: tuple, leaves: list) -> Callable | None:
        """Return the kept program, or trace and keep it; None if it cannot be kept."""
        structure, static, shapes = kind

        def flat(*leaves):
            args, named = jax.tree.unflatten(structure, leaves)
            return self._function(*args, **named, **dict(static))

        flat.__name__ = self._function.__name__
        try:
            parts = self.__module__, flat.__name__, _outline(structure), _text(static)
        except _Foreign:
            return None
        settings = jax.default_backend(), _setting("jax_enable_x64")
        text = repr((parts, shapes, settings))
        file = folder / f"export-{_code()}" / hashlib.sha256(text.encode()).hexdigest()
        with suppress(Exception):
            return jax.jit(_read(file).call)
        try:
            exported = jax.export.export(jax.jit(flat))(*leaves)
            _write(file, exported.serialize())
        except (ValueError, NotImplementedError, OSError):
            # Such as a result that holds classes, or a call back into Python.
            return None
        return jax.jit(exported.call)

    def clear_cache(self) -> None:
        """Release what was compiled."""
        self._jitted.clear_cache()
        self._loaded.clear()


def _setting(name: str) -> Any:
    # `jax.config.read` refuses those that a context may change.
    return getattr(jax.config, name)


def _is_special(leaves: list) -> bool:
    """Return whether a transformation or a debugging mode needs `jax.jit` itself."""
    modes = "jax_disable_jit", "jax_debug_nans", "jax_debug_infs"
    tracing = any(isinstance(leaf, Tracer) for leaf in leaves)
    return tracing or any(map(_setting, modes))


def _read(file: Path) -> Any:
    content: Any = bytearray(file.read_bytes())
    return jax.export.deserialize(content)


def _write(file: Path, content: bytes | bytearray) -> None:
    """Write a file, whole or not at all."""
    file.parent.mkdir(0o700, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as part:
        part.write(content)
    os.replace(part.name, file)


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
    """Return what is no array as text.

    Raises:
        _Foreign: it is, or is an instance of, a class of other code.
    """
    if isinstance(value, tuple | list):
        return f"({','.join(map(_text, value))})"
    if isinstance(value, set | frozenset):
        return f"{{{','.join(sorted(map(_text, value)))}}}"
    if isinstance(value, Mapping):
        return _text(sorted(value.items()))
    kind = value if isinstance(value, type) else type(value)
    if kind.__module__.partition(".")[0] not in ("builtins", "hdcal", *_TRACED):
        raise _Foreign
    return f"{kind.__module__}.{kind.__qualname__}" if kind is value else repr(value)
