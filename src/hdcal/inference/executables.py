"""The sampler's executables are released before they exhaust the memory mappings."""

import gc
from pathlib import Path

from hdcal.inference import independence, laplace, sample
from hdcal.programs import ahead

_MAPS = Path("/proc/self/maps")
_LIMIT = Path("/proc/sys/vm/max_map_count")


def bound_executables() -> bool:
    """Release the sampler's executables where memory mappings are scarce.

    Each kind of problem (set of effects, structure, bucket of rows) takes some 1,400
    mappings, nearly all of them for the search of the mode and the sampler. What is
    released is compiled again when it is needed, or read from the cache on disk;
    executables that are not the sampler's stay.

    Returns:
        Whether they were released.
    """
    if not mappings_are_scarce():
        return False
    for compiled in (
        m for room in (laplace, sample, independence) for m in room.COMPILED
    ):
        compiled.clear_cache()  # pyright: ignore[reportAttributeAccessIssue]
    ahead.release()
    gc.collect()
    return True


def mappings_are_scarce() -> bool:
    """Return whether half of the memory mappings that Linux allows are in use.

    A process may have 65,530. JAX keeps what was compiled, and the compilation that
    finds no mapping left kills the process. Elsewhere than on Linux none are scarce.
    """
    try:
        limit = int(_LIMIT.read_text())
        used = _MAPS.read_bytes().count(b"\n")
    except (OSError, ValueError):
        return False
    return used > limit // 2
