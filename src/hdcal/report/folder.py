"""Results on disk: a folder or a file appears whole, or not at all."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hdcal.errors import Finding, InputError

# What hdcal writes into a result folder: --force replaces these and nothing else.
OUTPUTS = frozenset(
    {
        "posterior.nc",
        "summary.json",
        "verdict.json",
        "refused.json",
        "bands.csv",
        "report.html",
        "calibration.svg",
        "calibration.png",
        "where.svg",
        "where.png",
        "which.svg",
        "which.png",
        "shrink.svg",
        "shrink.png",
        "bands.svg",
        "bands.png",
        "scores.json",
        "bar.svg",
        "bar.png",
        "confusion.svg",
        "confusion.png",
        "reliability.svg",
        "reliability.png",
        "detection.svg",
        "detection.png",
        "response.json",
        "response.csv",
        "response.svg",
        "response.png",
        "motion.csv",
        "motion.svg",
        "motion.png",
        "opening.json",
        "labels.json",
        "fit.json",
        "fit.svg",
        "fit.png",
        "audit.json",
        "design.json",
        "design.svg",
        "design.png",
        "profile.svg",
        "profile.png",
        "study.csv",
        "study.json",
        "study.svg",
        "study.png",
        "margin.json",
        "margin.svg",
        "margin.png",
        "tornado.svg",
        "tornado.png",
    }
)
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})


def is_result(entry: Path) -> bool:
    """Tell whether something in a folder belongs to a calibration or diagnosis."""
    return _is_output(entry) or _is_verdict(entry)


def check_target(
    target: Path | str,
    *,
    force: bool = False,
    ours: Callable[[Path], bool] = is_result,
    replace: str = "force",
) -> None:
    """Refuse a result that could not be written, before any work is done.

    Args:
        target: the folder to make.
        force: whether an older result may be replaced.
        ours: tells what in an older folder may be replaced.
        replace: the parameter that replaces it.

    Raises:
        InputError: it exists, is a file, or its parent cannot be written to.
    """
    _check_place(Path(target))
    real = _real(target)
    if real.is_dir():
        _check_existing(real, target, force, ours, replace)
    elif real.exists():
        raise _refusal(target, "is a file", "Name a folder that does not exist yet")


def check_file(target: Path | str, *, force: bool = False) -> None:
    """Refuse a file that could not be written; the rules are those of a folder.

    Raises:
        InputError: it exists, is a folder, or its parent cannot be written to.
    """
    _check_place(Path(target))
    real = _real(target)
    if real.is_dir():
        raise _refusal(target, "is a folder", "Name a file")
    if real.exists() and not force:
        remedy = "Name another file, or say `force` to replace it"
        raise _refusal(target, "exists already", remedy)


@contextmanager
def whole_folder(
    target: Path | str,
    *,
    force: bool = False,
    ours: Callable[[Path], bool] = is_result,
) -> Iterator[Path]:
    """Yield a folder beside the target that takes its place when all went well.

    An older result stays until the new one is complete. Whatever goes wrong, an
    interruption included, nothing is left behind.

    Args:
        target: the folder to make.
        force: whether an older result may be replaced.
        ours: tells what in an older folder may be replaced.

    Raises:
        InputError: as `check_target`, or the disk refused.
    """
    check_target(target, force=force, ours=ours)
    real = _real(target)
    building = _sibling(real)
    try:
        building.mkdir()
        yield building
        _put(building, real)
    except OSError as error:
        raise _unwritable(target, error) from error
    finally:
        shutil.rmtree(building, ignore_errors=True)


def write_whole(target: Path | str, text: str, *, force: bool = False) -> None:
    """Write a text file that appears whole or not at all.

    Raises:
        InputError: as `check_file`, or the disk refused.
    """
    check_file(target, force=force)
    real = _real(target)
    building = _sibling(real)
    try:
        building.write_text(text, "utf-8", newline="")
        building.replace(real)
    except OSError as error:
        raise _unwritable(target, error) from error
    finally:
        building.unlink(missing_ok=True)


def _put(building: Path, real: Path) -> None:
    """Give the finished folder its name; an older one is out of the way by then."""
    if not real.exists():
        building.rename(real)
        return
    older = _sibling(real)
    real.rename(older)
    try:
        building.rename(real)
    except BaseException:
        older.rename(real)
        raise
    shutil.rmtree(older, ignore_errors=True)


def _real(target: Path | str) -> Path:
    # Behind a link: the link stays, and the rename stays on one file system.
    return Path(os.path.realpath(target))


def _sibling(real: Path) -> Path:
    return real.parent / f".hdcal-{secrets.token_hex(6)}"


def _check_place(target: Path) -> None:
    parent = _real(target).parent
    try:
        _real(target).lstat()
    except FileNotFoundError:
        pass
    except NotADirectoryError:
        raise _refusal(target, "lies inside a file", "Name another place") from None
    except OSError as error:
        raise _unwritable(target, error) from error
    if not parent.is_dir():
        raise _refusal(target, "its parent folder does not exist", "Make that first")
    # Only a trial tells: permissions, read-only disks and quotas all have a say.
    trial = _sibling(_real(target))
    try:
        trial.mkdir()
        trial.rmdir()
    except OSError as error:
        raise _unwritable(target, error) from error


def _check_existing(
    real: Path,
    target: Path | str,
    force: bool,
    ours: Callable[[Path], bool],
    replace: str,
) -> None:
    if not force:
        remedy = f"Name another folder with `out`, or say `{replace}` to replace it"
        raise _refusal(target, "exists already", remedy)
    foreign = sorted(
        entry.name
        for entry in real.iterdir()
        if not (ours(entry) or entry.name in _LITTER)
    )
    if foreign:
        words = f"holds '{foreign[0]}', which hdcal did not write"
        remedy = f"`{replace}` replaces results only: name another folder"
        raise _refusal(target, words, remedy)


def _is_output(entry: Path) -> bool:
    # A diagnosis keeps every model that it calibrated.
    model = entry.name.startswith("posterior-") and entry.suffix == ".nc"
    return (model or entry.name in OUTPUTS | _LITTER) and entry.is_file()


def _is_verdict(entry: Path) -> bool:
    """Tell whether it is one case's folder among those of many cases."""
    if not entry.is_dir() or entry.is_symlink():
        return False
    inside = list(entry.iterdir())
    return (entry / "verdict.json") in inside and all(map(_is_output, inside))


def _refusal(target: Path | str, problem: str, remedy: str) -> InputError:
    return InputError([Finding(str(target) or "out", problem, remedy)])


def _unwritable(target: Path | str, error: OSError) -> InputError:
    words = f"cannot be written ({error.strerror or error})"
    return _refusal(target, words, "Check space and permissions, or name another place")
