"""Where a result is built, and how what a killed process left there is finished."""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

from hdcal.report.saving.contents import (
    Foreign,
    Unstamped,
    older_result,
    result_entries,
)
from hdcal.report.saving.disk import rename_beside, rename_new
from hdcal.report.saving.lock import Lock

# A working folder of a process holds these, each under the target's own name:
# the new result, nobody's loss; a result that changes places with it, never removed
# unseen; and an older one that was seen to be hdcal's, being removed.
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
    for folder in (SWAPPING, REMOVING, ""):
        with suppress(FileNotFoundError):
            (working / folder).rmdir()


def remove_result(aside: Path, unstamped: Unstamped) -> Path | None:
    """Remove a replaced result, unless it holds anything that is not hdcal's.

    Args:
        aside: the result, in a folder of a working folder.
        unstamped: tells what is hdcal's where there is no stamp.

    Returns:
        Where it was put instead, beside its former place; None if it was removed.

    Raises:
        OSError: the disk refused.
    """
    working = aside.parents[1]
    try:
        entries = result_entries(aside, unstamped)
        if aside.parent.name == SWAPPING:
            # From here on it is never brought back: it will not be whole.
            (working / REMOVING).mkdir(exist_ok=True)
            aside = aside.rename(working / REMOVING / aside.name)
            entries = result_entries(aside, unstamped)
        for path in entries:
            if path.is_dir():
                path.rmdir()
            else:
                path.unlink()
        aside.rmdir()
    except (Foreign, OSError):
        return rename_beside(aside, working.parent / aside.name)
    return None


def _entries(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []
