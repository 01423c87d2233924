"""What may be opened: regular files of a stated size, nothing endless."""

import stat
from pathlib import Path


def why_not_readable(path: Path, largest: int) -> tuple[str, str] | None:
    """Return problem and remedy where a file is no finite one, or too large.

    A file that is missing or may not be looked at is left to who opens it.

    Args:
        path: of the file; links are followed.
        largest: size that is still read [bytes].
    """
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    if stat.S_ISDIR(found.st_mode):
        return "is a folder", "Name the file inside it"
    if not stat.S_ISREG(found.st_mode):
        return "is a pipe or a device, which may never end", "Write it to a file first"
    if found.st_size > largest:
        return f"is larger than {_size(largest)}", "Name another file, or thin this out"
    return None


def _size(largest: int) -> str:
    unit, words = max((u, w) for u, w in _UNITS if largest >= u)
    return f"{largest // unit} {words}"


_UNITS = ((1 << 10, "KiB"), (1 << 20, "MiB"), (1 << 30, "GiB"))
