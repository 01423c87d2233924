"""Steps on a disk: writes, syncs, and renames that replace nothing."""

import ctypes
import errno
import os
from itertools import count
from pathlib import Path

_NO_REPLACE, _EXCHANGE = 1, 2
_FROM_HERE = -100  # AT_FDCWD: relative names are below the working directory
# The errors of a system that does not know such a rename, or such a sync.
_UNKNOWN = {errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP}


def write_file(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write a new file.

    Args:
        path: must not exist.
        data: its content.
        mode: its permissions, of which the process's mask takes some away.

    Raises:
        OSError: it exists, or the disk refused.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    try:
        left = memoryview(data)
        while left:
            left = left[os.write(descriptor, left) :]
    finally:
        os.close(descriptor)


def sync(path: Path) -> None:
    """Wait until the disk holds a file's content, or the names in a folder.

    Raises:
        OSError: the disk refused.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some file systems have nothing to wait for.
        if error.errno not in _UNKNOWN:
            raise
    finally:
        os.close(descriptor)


def rename_new(source: Path, target: Path) -> None:
    """Rename a file or a folder and replace nothing.

    Raises:
        FileExistsError: the target exists.
        OSError: the disk refused.
    """
    if _rename(source, target, _NO_REPLACE):
        return
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
    os.rename(source, target)


def rename_beside(source: Path, target: Path) -> Path:
    """Rename to the first free name of `target-2`, `target-3`, …, and return it.

    Raises:
        OSError: the disk refused.
    """
    ending = "" if source.is_dir() else target.suffix
    stem = target.name.removesuffix(ending)
    for number in count(2):
        beside = target.with_name(f"{stem}-{number}{ending}")
        try:
            rename_new(source, beside)
        except FileExistsError:
            continue
        return beside
    raise AssertionError("numbers do not end")


def exchange(one: Path, other: Path) -> bool:
    """Let two files or folders swap their names in one step.

    Returns:
        Whether system and file system know how; if not, nothing has changed.

    Raises:
        OSError: the disk refused.
    """
    return _rename(one, other, _EXCHANGE)


def _rename(source: Path, target: Path, flag: int) -> bool:
    """Call Linux's renameat2; tell whether there is one for these names."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is None:
        return False
    names = os.fsencode(source), os.fsencode(target)
    if renameat2(_FROM_HERE, names[0], _FROM_HERE, names[1], flag) == 0:
        return True
    number = ctypes.get_errno()
    if number in _UNKNOWN:
        return False
    raise OSError(number, os.strerror(number), str(source), None, str(target))
