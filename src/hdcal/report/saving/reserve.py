"""Reserve the place of a result before any work is done, or say why it is refused."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TypeVar

from hdcal.errors import Finding, InputError
from hdcal.report.saving.contents import Foreign, Unstamped, older_result
from hdcal.report.saving.leftovers import sweep
from hdcal.report.saving.lock import Lock, lock_key
from hdcal.report.saving.target import Target, TargetFile, TargetFolder, not_writable

T = TypeVar("T", bound=Target)
# Another process may hold a lock for a moment, to see what a killed one has left.
_TRIALS, _PAUSE_S = 25, 0.02


def reserve_folder(
    target: Path | str,
    *,
    force: bool = False,
    replace: str = "force",
    unstamped: Unstamped = older_result,
) -> TargetFolder:
    """Reserve a folder for a result.

    What killed processes left beside it is brought back or removed first.

    Args:
        target: the folder to make.
        force: whether an older result may be replaced.
        replace: the parameter that says so.
        unstamped: tells what is hdcal's in a folder without a stamp.

    Raises:
        InputError: it exists, is a file, another process writes it, or its parent
            cannot be written to.
    """

    def judge(place: TargetFolder) -> None:
        if not place.path.is_dir():
            remedy = "Name a folder that does not exist yet"
            raise _refusal(target, "is a file", remedy)
        if not force:
            remedy = f"Name another folder with `out`, or say `{replace}` to replace it"
            raise _refusal(target, "exists already", remedy)
        _check(place, f"`{replace}` replaces results only: name another folder")

    with _refused(target):
        return _reserve(partial(TargetFolder, unstamped=unstamped), target, judge)


def reserve_file(
    target: Path | str, *, force: bool = False, beginning: str | bytes = b""
) -> TargetFile:
    """Reserve a file; the rules are those of a folder.

    Args:
        target: the file to make.
        force: whether an older one may be replaced.
        beginning: of such a file.

    Raises:
        InputError: it exists, is a folder, another process writes it, or its parent
            cannot be written to.
    """

    def judge(place: TargetFile) -> None:
        if place.path.is_dir():
            raise _refusal(target, "is a folder", "Name a file")
        if not force:
            remedy = "Name another file, or say `force` to replace it"
            raise _refusal(target, "exists already", remedy)
        _check(place, "`force` replaces such a file only: name another one")

    begins = beginning.encode() if isinstance(beginning, str) else beginning
    with _refused(target):
        return _reserve(partial(TargetFile, beginning=begins), target, judge)


def write_whole(target: Path | str, text: str) -> None:
    """Write a new text file in the middle of work, whole or not at all.

    Raises:
        InputError: it exists, or another process writes it.
        NotWritable: the disk refused.
    """

    def judge(_: TargetFile) -> None:
        raise _refusal(target, "exists already", "Move it away")

    make = partial(TargetFile, beginning=b"")
    try:
        place = _reserve(make, target, judge, sweeping=False)
    except OSError as error:
        raise not_writable(str(target), error) from error
    with place:
        place.write(text.encode())


def _reserve(
    make: Callable[..., T],
    target: Path | str,
    judge: Callable[[T], None],
    *,
    sweeping: bool = True,
) -> T:
    """Lock a place and look what is there.

    Args:
        make: the place, from name, path, lock and whether anything is there.
        target: as the user named it.
        judge: refuses what is there.
        sweeping: whether to look for what killed processes left beside it.

    Raises:
        InputError: it can be no place, or another process writes to it.
        OSError: the disk refused.
    """
    path = Path(os.path.realpath(target))
    try:
        path.lstat()
    except FileNotFoundError:
        pass
    except NotADirectoryError:
        raise _refusal(target, "lies inside a file", "Name another place") from None
    if not path.parent.is_dir():
        raise _refusal(target, "its parent folder does not exist", "Make that first")
    lock = _lock(target, path)
    try:
        # Only a trial tells: permissions, read-only disks and quotas have a say.
        lock.sign()
        if sweeping:
            sweep(path.parent, lock)
        place = make(str(target), path, lock, os.path.lexists(path))
        if place.existed:
            judge(place)
        return place
    except BaseException:
        lock.release()
        raise


def _lock(target: Path | str, path: Path) -> Lock:
    key = lock_key(path)
    for _ in range(_TRIALS):
        lock = Lock.take(path.parent, key)
        if lock is not None:
            return lock
        time.sleep(_PAUSE_S)
    words = f"is being written by {Lock.owner(path.parent, key)}"
    raise _refusal(target, words, "Wait for its end, or name another place")


def _check(place: Target, remedy: str) -> None:
    if os.path.ismount(place.path):
        words = "is where a disk is mounted, and cannot be replaced"
        raise _refusal(place.name, words, "Name a folder inside it")
    try:
        place.check()
    except Foreign as error:
        raise _refusal(place.name, str(error), remedy) from None


@contextmanager
def _refused(target: Path | str) -> Iterator[None]:
    """Say of a disk that refuses before any work that the target cannot be used."""
    try:
        yield
    except OSError as error:
        words = f"cannot be written ({error.strerror or error})"
        remedy = "Check space and permissions, or name another place"
        raise _refusal(target, words, remedy) from error


def _refusal(target: Path | str, problem: str, remedy: str) -> InputError:
    return InputError([Finding(str(target) or "out", problem, remedy)])
