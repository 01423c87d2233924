"""Where a result is built, and how what a killed process left there is finished."""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

from hdcal.report.saving.contents import (
    STAMP,
    Foreign,
    Unstamped,
    check_file,
    older_result,
    result_entries,
)
from hdcal.report.saving.disk import rename_beside, rename_new
from hdcal.report.saving.lock import Lock

# A working folder of a process holds these, each under the target's own name:
# the new result, nobody's loss; a result that changes places with it, never removed
# unseen; and an older one that was seen to be hdcal's, being removed. Where they are
# files of their own, a stamp beside these folders says what they held.
BUILDING, SWAPPING, REMOVING = "building", "swapping", "removing"
_HIDDEN = re.compile(r"\.hdcal-([0-9a-f]{12})(\.lock|-[0-9a-f]{12})")


def sweep(parent: Path, own: Lock) -> None:
    """Finish and remove what killed processes left in a folder.

    Args:
        parent: the folder.
        own: a lock that this process holds on the same disk.

    Raises:
        OSError: the folder cannot be read.
    """
    if not own.firm:
        return  # nobody can tell whether they are dead
    matches = map(_HIDDEN.fullmatch, os.listdir(parent))
    for key in sorted({match[1] for match in matches if match}):
        # What another user left may be out of reach.
        with suppress(OSError):
            is_own = (own.path.parent, own.key) == (parent, key)
            lock = own if is_own else Lock.take(parent, key)
            if lock is None:
                continue
            try:
                for working in sorted(parent.glob(f".hdcal-{key}-*")):
                    # A link may lead to what was never hdcal's.
                    if _HIDDEN.fullmatch(working.name) and not working.is_symlink():
                        finish(working)
            finally:
                if lock is not own:
                    lock.release()


def finish(working: Path) -> None:
    """Bring back or remove what a working folder holds, then remove it.

    Raises:
        OSError: the disk refused.
    """
    shutil.rmtree(working / BUILDING, ignore_errors=True)
    for aside in _entries(working / SWAPPING):
        try:
            rename_new(aside, working.parent / aside.name)
        except FileExistsError:
            remove_result(aside, older_result)
    for left in _entries(working / REMOVING):
        # Emptied, and not yet removed itself.
        for path in sorted(left.rglob("*/"), reverse=True):
            with suppress(OSError):
                path.rmdir()
        remove_result(left, older_result)
    with suppress(FileNotFoundError):
        (working / STAMP).unlink()
    for folder in (SWAPPING, REMOVING, ""):
        with suppress(FileNotFoundError):
            (working / folder).rmdir()


def remove_result(aside: Path, unstamped: Unstamped) -> tuple[Path, str] | None:
    """Remove a replaced result, unless it holds anything that is not hdcal's.

    Args:
        aside: the result, in a folder of a working folder.
        unstamped: tells what is hdcal's where there is no stamp.

    Returns:
        Where it was put instead, beside its former place, and why; None if it was
        removed.

    Raises:
        OSError: the disk refused; a part of it may be gone.
    """
    working = aside.parents[1]
    leaving = working / REMOVING / aside.name
    try:
        entries = _removable(aside, unstamped)
        if aside != leaving:
            # From here on it is never brought back: it will not be whole.
            leaving.parent.mkdir(exist_ok=True)
            aside.rename(leaving)
    except (Foreign, OSError) as error:
        if aside == leaving and isinstance(error, OSError):
            raise  # of what was begun nothing is shown
        why = str(error)
        if isinstance(error, OSError):
            why = f"could not be removed ({error.strerror or error})"
        return rename_beside(aside, working.parent / aside.name), why
    for path in [leaving / entry.relative_to(aside) for entry in [*entries, aside]]:
        if path.is_dir():
            path.rmdir()
        else:
            path.unlink()
    return None


def _removable(aside: Path, unstamped: Unstamped) -> list[Path]:
    """Return what lies below a replaced result, all of it seen to be hdcal's."""
    working = aside.parents[1]
    if not os.path.lexists(working / STAMP):
        return result_entries(aside, unstamped)
    check_file(aside, working)
    return []


def _entries(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []
