"""Write a result, be killed at the n-th call of the system for every n, and look.

Run as a script: in a process without threads, where a fork costs a millisecond.
"""

import json
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hdcal.report.saving import disk
from hdcal.report.saving.reserve import reserve_file, reserve_folder

OLD, NEW, MINE = "old", "new", "years of work"
TABLE = "deformation_mm,"


def write_folder(target: Path, text: str) -> None:
    """Write a result that has a folder inside, over an older one if there is one."""
    with reserve_folder(target, force=True) as place, place.filled() as building:
        for name in ("report.html", "summary.json"):
            disk.write_file(building / name, text.encode())
        (building / "case").mkdir()
        disk.write_file(building / "case" / "verdict.json", text.encode())


def write_file(target: Path, text: str) -> None:
    """Write a table, over an older one if there is one."""
    with reserve_file(target, force=True, beginning=TABLE) as place:
        place.write((TABLE + text).encode())


def write_unstamped(target: Path, text: str) -> None:
    """Write a result of many cases as an hdcal without stamps did."""
    for case in ("a", "b"):
        (target / case).mkdir(parents=True)
        (target / case / "verdict.json").write_text('{"schema": "hdcal.verdict/1"}')
        (target / case / "report.html").write_text(text)


def folder_text(target: Path) -> str | None:
    """Return the text of a whole result; 'broken' if it is not whole."""
    if not target.exists():
        return None
    if (target / "a").exists():
        files = [target / case / "report.html" for case in ("a", "b")]
        whole = all((target / case / "verdict.json").exists() for case in ("a", "b"))
    else:
        files = [target / "report.html", target / "summary.json"]
        files.append(target / "case" / "verdict.json")
        whole = (target / "hdcal-result.json").exists()
    texts = {path.read_text() if path.exists() else "" for path in files}
    return texts.pop() if whole and len(texts) == 1 else "broken"


def file_text(target: Path) -> str | None:
    """Return the text of a whole table; 'broken' if it is not whole."""
    if not target.exists():
        return None
    text = target.read_text().removeprefix(TABLE)
    return text if text in (OLD, NEW) else "broken"


Write = Callable[[Path, str], None]
Look = Callable[[Path], str | None]
# What is there before, what is done, how it is read.
WAYS: dict[str, tuple[Write | None, Write, Look]] = {
    "new folder": (None, write_folder, folder_text),
    "folder over folder": (write_folder, write_folder, folder_text),
    "folder over one of v0.1": (write_unstamped, write_folder, folder_text),
    "new file": (None, write_file, file_text),
    "file over file": (write_file, write_file, file_text),
}


def kill_at(number: int) -> None:
    """Kill this process before the call of the system of that number."""
    left = number

    def count(frame: Any, event: str, called: Any) -> None:
        nonlocal left
        if event == "call":
            # Its call goes past Python's own functions.
            calls = frame.f_code is disk._rename.__code__
        elif event == "c_call":
            owner = type(getattr(called, "__self__", None)).__module__
            calls = called.__module__ in ("posix", "fcntl", "_io") or owner == "_io"
            calls &= called.__name__ != "fspath"
        else:
            return
        left -= calls
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(count)


def killed(number: int, work: Callable[..., object], *given: object) -> bool:
    """Do something in a process that is killed; tell whether it was in time."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            kill_at(number)
            work(*given)
            sys.setprofile(None)
            status = 0
        finally:
            os._exit(status)
    _, status = os.waitpid(child, 0)
    if status == signal.SIGKILL:
        return True
    if status != 0:
        raise RuntimeError(f"failed at call {number}")
    return False


def start(folder: Path) -> None:
    """Start any command into a folder."""
    with reserve_folder(folder / "another"):
        pass


def look(folder: Path, read: Look, allowed: set[str | None], final: bool) -> list[str]:
    """Return what is wrong with a folder after a kill, or after the next start."""
    text, names = read(folder / "target"), {path.name for path in folder.iterdir()}
    wrong = [] if text in allowed else [f"the target is {text}"]
    if not final:
        return wrong
    if (folder / "mine.txt").read_text() != MINE:
        wrong.append("a file of the user is lost")
    extra = names - {"mine.txt", "target"}
    return wrong + ([f"left behind: {sorted(extra)}"] if extra else [])


def prepare(folder: Path, before: Write | None) -> Path:
    """Make a folder of a user, with an older result if there is to be one."""
    folder.mkdir()
    (folder / "mine.txt").write_text(MINE)
    if before is not None:
        before(folder / "target", OLD)
    return folder


def attack(way: str, renames: bool, again: bool, base: Path) -> dict[str, Any]:
    """Kill a write at every call, each followed by a next start.

    Args:
        way: one of `WAYS`.
        renames: whether the system can swap two names in one step.
        again: kill the next start too, at every call.
        base: an empty folder.
    """
    if not renames:
        disk.__dict__["_rename"] = lambda *_: False
    before, write, read = WAYS[way]
    former = None if before is None else OLD
    # With two renames there is a moment without the target, until the next start.
    early = {former, NEW} if renames else {former, NEW, None}
    number, calls, kills, wrong = 0, 0, 0, []
    ended = False
    while not ended:
        # Of the first kills a seventh, where each is followed by many others.
        number, calls, second = number + (7 if again else 1), calls + 1, 0
        restarted = False
        while not restarted:
            second += 1
            folder = prepare(base / f"{number}-{second}", before)
            ended = not killed(number, write, folder / "target", NEW)
            kills += not ended
            found = look(folder, read, {NEW} if ended else early, final=False)
            restarted = not again or not killed(second, start, folder)
            kills += not restarted
            found += look(folder, read, early, final=False)
            start(folder)
            found += look(folder, read, {former, NEW}, final=True)
            wrong += [f"{way}, call {number}/{second}: {words}" for words in found]
            shutil.rmtree(folder)
    return {"calls": calls - 1, "kills": kills, "wrong": wrong}


if __name__ == "__main__":
    chosen, can, twice = sys.argv[1:]
    # In memory, where there is such a folder: a disk takes its time to sync.
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as place:
        # What a process does only once is no part of it.
        WAYS[chosen][1](Path(place, "first"), NEW)
        print(json.dumps(attack(chosen, can == "1", twice == "1", Path(place))))
