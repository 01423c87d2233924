"""Files that may be opened: regular ones of a stated size, nothing endless."""

import stat
from pathlib import Path

_UNITS = {1 << 10: "KiB", 1 << 20: "MiB", 1 << 30: "GiB"}


def why_not_readable(path: Path, largest: int) -> tuple[str, str] | None:
    """Return problem and remedy where a file is no finite one, or too large.

    A file that is missing or may not be looked at is left to who opens it.
    """
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    if stat.S_ISDIR(status.st_mode):
        return "is a folder", "Name the file inside it"
    if not stat.S_ISREG(status.st_mode):
        return "is a pipe or a device, which may never end", "Write it to a file first"
    if status.st_size > largest:
        unit = max(one for one in _UNITS if largest >= one)
        words = f"is larger than {largest // unit} {_UNITS[unit]}"
        return words, "Name another file, or thin this out"
    return None
