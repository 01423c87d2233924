"""Where programs are kept: a folder of its own for each version of the code.

What is damaged there is thrown away; where nothing can be kept, nothing is.
"""

import hashlib
import os
import platform
import secrets
import shutil
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import jax
from jax.experimental.compilation_cache import compilation_cache

from hdcal.programs.compiling import loaded

# Versions of the code whose programs stay beside each other in one cache.
_VERSIONS_KEPT = 4
# Libraries of which a trace has code.
TRACED = ("jax", "jaxlib", "numpyro", "equinox", "diffrax", "optimistix", "lineax")
_CODE = Path(__file__).parents[1]
_DIGEST_SIZE = hashlib.sha256().digest_size
# Nobody else may write what is run.
_OWN, _OTHERS_WRITE = 0o700, 0o022
# Machine code is packed to a third, in a tenth of the time that it took to compile.
_FAST = 1
# The folder in which programs are kept, if they are.
_kept_in: str | None = None


def read(file: Path) -> Callable | None:
    """Return the program that is kept; a file that is damaged is thrown away."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    digest, kept = content[:_DIGEST_SIZE], content[_DIGEST_SIZE:]
    with suppress(Exception):
        if _digest(file, kept) == digest:
            return loaded(zlib.decompress(kept))
    with suppress(OSError):
        file.unlink()
    return None


def write(file: Path, kept: bytes) -> None:
    """Keep a program, of what `to_keep` returned."""
    packed = zlib.compress(kept, _FAST)
    put(file, _digest(file, packed) + packed)


def _digest(file: Path, packed: bytes) -> bytes:
    """Return what tells damage, and a file that has the name of another."""
    return hashlib.sha256(file.name.encode() + packed).digest()


def put(file: Path, content: bytes) -> None:
    """Write a file, whole or not at all; a full disk keeps none."""
    part = file.with_suffix(f".{secrets.token_hex(4)}")
    with suppress(OSError):
        try:
            part.write_bytes(content)
            os.replace(part, file)
        finally:
            part.unlink(missing_ok=True)


def keep_in(folder: str | None) -> None:
    """Keep programs in a folder, or nowhere, from now on, and JAX nothing of its own.

    What JAX' compilation cache returned cannot be kept: XLA writes an executable that
    it has read without parts that it needs.
    """
    global _kept_in
    jax.config.update("jax_compilation_cache_dir", None)
    compilation_cache.reset_cache()
    _kept_in = folder


def folder() -> Path | None:
    """Return the folder of this code's programs; None where nothing is kept."""
    # Flags are put there at import time, out of pyright's sight.
    own = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    return None if own or _kept_in is None else _folder_in(_kept_in)


@cache
def _folder_in(kept: str) -> Path | None:
    whole = Path(kept) / "programs"
    try:
        found = whole / _of_code_and_machine()
        for one in (whole, found):
            one.mkdir(_OWN, parents=True, exist_ok=True)
            held = one.stat()
            if held.st_mode & _OTHERS_WRITE or held.st_uid != os.getuid():
                return None
        os.utime(found)
        older = sorted(whole.iterdir(), key=lambda one: one.stat().st_mtime)
        for one in older[:-_VERSIONS_KEPT]:
            shutil.rmtree(one, ignore_errors=True)
    except OSError:
        return None
    return found


def _of_code_and_machine() -> str:
    """Return a digest of all code that a program may have, and of what runs it."""
    whole = hashlib.sha256(_processor().encode())
    for file in sorted(_CODE.rglob("*.py")):
        whole.update(str(file.relative_to(_CODE)).encode() + file.read_bytes())
    for name in TRACED:
        with suppress(PackageNotFoundError):
            # Its version is in there; to look for it takes longer than to read all.
            found = distribution(name)
            told = found.read_text("METADATA") or found.read_text("PKG-INFO")
            whole.update((told or found.version).encode())
    return whole.hexdigest()[:32]


def _processor() -> str:
    """Return what tells processors apart that do not know the same instructions."""
    with suppress(OSError, StopIteration), open("/proc/cpuinfo") as told:
        names = "flags", "Features"
        return next(line for line in told if line.startswith(names))
    return f"{platform.machine()} {platform.processor()}"
