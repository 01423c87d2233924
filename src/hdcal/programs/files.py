"""Where programs are kept: a folder of its own for each version of the code.

What is damaged there is thrown away; where nothing can be kept, nothing is.
"""

import hashlib
import os
import secrets
import shutil
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from jax import export

# Versions of the code whose programs stay beside each other in one cache.
_VERSIONS_KEPT = 4
# Libraries of which a trace has code.
TRACED = ("jax", "jaxlib", "numpyro", "equinox", "diffrax", "optimistix", "lineax")
_CODE = Path(__file__).parents[1]
_DIGEST_SIZE = hashlib.sha256().digest_size
# Nobody else may write what is run.
_OWN, _OTHERS_WRITE = 0o700, 0o022


def read(file: Path) -> export.Exported | None:
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


def write(file: Path, kept: bytes) -> None:
    """Keep a program."""
    put(file, hashlib.sha256(kept).digest() + kept)


def put(file: Path, content: bytes) -> None:
    """Write a file, whole or not at all; a full disk keeps none."""
    part = file.with_suffix(f".{secrets.token_hex(4)}")
    with suppress(OSError):
        try:
            part.write_bytes(content)
            os.replace(part, file)
        finally:
            part.unlink(missing_ok=True)


@cache
def folder_in(cached: str | None) -> Path | None:
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
    for name in TRACED:
        with suppress(PackageNotFoundError):
            whole.update(f"{name} {version(name)}".encode())
    return whole.hexdigest()[:32]
