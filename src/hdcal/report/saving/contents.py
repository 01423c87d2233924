"""The stamp in a result folder: which files hdcal wrote there, and what they held."""

import hashlib
import json
import os
import re
import stat
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from hdcal.report.plain import as_json, printable
from hdcal.report.saving.disk import sync, write_file

STAMP, SCHEMA = "hdcal-result.json", "hdcal.result/1"
# What file managers leave behind on their own.
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
# Results of before there was a stamp: an answer with its schema, and these files.
_ANSWER = re.compile(
    r"(summary|verdict|scores|response|fit|audit|design|study|margin)\.json"
)
_UNSTAMPED = re.compile(
    rf"{_ANSWER.pattern}|(opening|labels)\.json|report\.html|posterior(-\w+)?\.nc"
    r"|(bands|response|motion|study)\.csv"
    r"|(calibration|where|which|shrink|bands|bar|confusion|reliability|detection"
    r"|response|motion|fit|design|profile|study|margin|tornado)\.(svg|png)"
)

# Returns what is hdcal's in a folder without a stamp: names of files below it.
Unstamped = Callable[[Path], Collection[str]]


class Foreign(Exception):
    """Not a result of hdcal, or not only that; the text says why, as 'it …'."""


def seal(folder: Path) -> None:
    """Write the stamp into a finished folder and wait until the disk holds all of it.

    Raises:
        OSError: the disk refused.
    """
    below = list(_below(folder))
    known = {
        path.relative_to(folder).as_posix(): size_and_sha256(path)
        for path in below
        if not _is_folder(path)
    }
    write_stamp(folder, known)
    for path in [*below, folder / STAMP, folder]:
        sync(path)


def write_stamp(folder: Path, known: Mapping[str, tuple[int, str]]) -> None:
    """Write size and SHA-256 of files, by their names, into a folder.

    Raises:
        OSError: the disk refused.
    """
    files = [
        {"file": name, "bytes": size, "sha256": sha256}
        for name, (size, sha256) in known.items()
    ]
    stamp = {"schema": SCHEMA, "version": _version(), "files": files}
    write_file(folder / STAMP, as_json(stamp).encode())


@cache
def _version() -> str:
    return metadata.version("hdcal")


def older_result(folder: Path) -> list[str]:
    """Return what an hdcal without stamps wrote, of one case or of many.

    Raises:
        OSError: it cannot be read.
    """
    places = [folder, *filter(_is_folder, folder.iterdir())]
    return [
        path.relative_to(folder).as_posix()
        for place in places
        if any(map(_is_answer, place.iterdir()))
        for path in place.iterdir()
        if _UNSTAMPED.fullmatch(path.name)
    ]


def result_entries(folder: Path, unstamped: Unstamped = older_result) -> list[Path]:
    """Return all below a result folder, in an order in which it can be removed.

    What tells that it is a result comes last, for a removal that is cut short.

    Args:
        folder: to look at.
        unstamped: tells what is hdcal's where there is no stamp.

    Raises:
        Foreign: it holds what hdcal did not write, or what was edited since.
        OSError: it cannot be read.
    """
    if not _is_folder(folder):
        raise Foreign("is no folder")
    known = _stamped(folder)
    if known is None:
        known = dict.fromkeys(unstamped(folder))
    parents = {folder / parent for name in known for parent in Path(name).parents}

    def checked(path: Path) -> Path:
        # Before it is looked into: whose folder this is may hold anything.
        name = path.relative_to(folder).as_posix()
        if _is_folder(path) and path in parents:
            return path
        if name not in known and not (path.name in _LITTER and is_file(path)):
            words = f"holds '{printable(name)}', which hdcal did not write with it"
            raise Foreign(words)
        if not is_file(path) or known.get(name) not in (None, size_and_sha256(path)):
            words = f"holds '{printable(name)}', which was edited since hdcal wrote it"
            raise Foreign(words)
        return path

    return list(_below(folder, checked))


def check_file(file: Path, stamped: Path) -> None:
    """Check that a file holds what a stamp says, under whatever name.

    Args:
        file: to look at.
        stamped: folder with the stamp.

    Raises:
        Foreign: it does not, or there is no such stamp.
        OSError: it cannot be read.
    """
    known = _stamped(stamped) or {}
    if not is_file(file) or size_and_sha256(file) not in known.values():
        raise Foreign("was edited while the result was made")


def _stamped(folder: Path) -> dict[str, Any] | None:
    """Return size and SHA-256 of each file by its name; None without a stamp."""
    path = folder / STAMP
    if not os.path.lexists(path):
        return None
    try:
        data = json.loads(path.read_text("utf-8")) if is_file(path) else {}
        if data["schema"] != SCHEMA:
            raise ValueError
        known = {one["file"]: (one["bytes"], one["sha256"]) for one in data["files"]}
        if not all(isinstance(name, str) for name in known):
            raise ValueError
    except (KeyError, TypeError, ValueError, RecursionError):
        words = f"holds '{STAMP}', which was edited since hdcal wrote it"
        raise Foreign(words) from None
    return known | {STAMP: None}


def size_and_sha256(path: Path) -> tuple[int, str]:
    """Return size and SHA-256 of a file.

    Raises:
        OSError: it cannot be read.
    """
    with open(path, "rb") as stream:
        sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
        return os.fstat(stream.fileno()).st_size, sha256


def _below(folder: Path, checked: Callable[[Path], Path] = Path) -> Iterator[Path]:
    """Yield all below a folder: content before its folder, what tells of it last.

    Args:
        folder: to walk.
        checked: is told of each before it is looked into.
    """

    def place(path: Path) -> tuple[bool, bool, str]:
        return path.name == STAMP, bool(_ANSWER.fullmatch(path.name)), path.name

    for path in map(checked, sorted(folder.iterdir(), key=place)):
        if _is_folder(path):
            yield from _below(path, checked)
        yield path


def _is_answer(path: Path) -> bool:
    if not _ANSWER.fullmatch(path.name) or not is_file(path):
        return False
    try:
        data = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError):
        return False
    return isinstance(data, dict) and str(data.get("schema")).startswith("hdcal.")


def is_file(path: Path) -> bool:
    """Tell whether a path is a file itself, and no link to one.

    Raises:
        OSError: it is not there.
    """
    return stat.S_ISREG(path.lstat().st_mode)


def _is_folder(path: Path) -> bool:
    return stat.S_ISDIR(path.lstat().st_mode)
