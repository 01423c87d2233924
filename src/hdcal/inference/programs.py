"""Compiled programs are let go before they exhaust what the system allows."""

import gc
from pathlib import Path

import jax

_MAPS = Path("/proc/self/maps")
_LIMIT = Path("/proc/sys/vm/max_map_count")


def let_go_of_programs() -> bool:
    """Forget all compiled programs when half of Linux' memory mappings are in use.

    A program takes some twenty of the 65 530 mappings that a process may have, a
    diagnosis of a new shape of data some two thousand; JAX keeps all of them, and the
    compilation that finds none left kills the process. What is forgotten is compiled
    again, or read from the cache on disk. Elsewhere than on Linux nothing is done.

    Returns:
        Whether they were let go.
    """
    try:
        limit = int(_LIMIT.read_text())
        used = _MAPS.read_bytes().count(b"\n")
    except (OSError, ValueError):
        return False
    if used <= limit // 2:
        return False
    jax.clear_caches()
    gc.collect()
    return True
