"""Write a result and be killed at the n-th step on the disk, for every n.

Run as a script, in a process without threads that can fork.
"""

import json
import os
import shutil
import signal
import sys
from pathlib import Path

from hdcal.report.saving import MARKER, Target

TABLE = "deformation_mm,"
STEPS = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "shutil.rmtree"}


def write_folder(path: Path, text: str, force: bool = True) -> None:
    """Write a result folder."""
    with Target(str(path), force) as target, target.filled() as folder:
        (folder / "summary.json").write_text(text)
        (folder / "case").mkdir()
        (folder / "case" / "verdict.json").write_text(text)


def write_file(path: Path, text: str, force: bool = True) -> None:
    """Write a table."""
    beginning = TABLE.encode()
    target = Target(str(path), force, beginning=beginning)
    with target, target.filled() as file:
        file.write_text(TABLE + text)


WRITE = {"folder": write_folder, "file": write_file}


def content(folder: Path) -> dict[str, str]:
    """Return the text of each file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_text() for path in files}


def result(path: Path) -> str | None:
    """Return the text of a whole result, None if there is nothing."""
    if not path.exists():
        return None
    if path.is_file():
        return path.read_text().removeprefix(TABLE)
    files = content(path)
    whole = files.pop(MARKER, None) and len(files) == 2 and len({*files.values()}) == 1
    return files["summary.json"] if whole else "broken"


def killed(kind: str, path: Path, number: int) -> bool:
    """Write in another process; return whether it was killed at the n-th step."""
    if (child := os.fork()) == 0:
        left = number

        def count(event: str, _) -> None:
            nonlocal left
            if event in STEPS:
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(count)
        WRITE[kind](path, "new")
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, -signal.SIGKILL)
    return code != 0


def main(kind: str, older: bool, folder: Path) -> None:
    """Print the result after a kill, after the next start, and what else was left."""
    outcomes = []
    alive = False
    while not alive:
        if older:
            WRITE[kind](folder / "run", "old")
        alive = not killed(kind, folder / "run", len(outcomes) + 1)
        at_once, left = result(folder / "run"), len({*os.listdir(folder)} - {"run"})
        beginning = None if kind == "folder" else TABLE.encode()
        with Target(str(folder / "run"), force=True, beginning=beginning):
            outcomes.append((at_once, result(folder / "run"), left))
        assert {*os.listdir(folder)} <= {"run"}
        shutil.rmtree(folder)
        folder.mkdir()
    print(json.dumps(outcomes))


if __name__ == "__main__":
    if sys.argv[1] == "hold":
        with Target(sys.argv[2]) as target:
            print("holds", flush=True)
            sys.stdin.read()
        write_folder(Path(sys.argv[2]), "new")
    else:
        main(sys.argv[1], bool(int(sys.argv[2])), Path(sys.argv[3]))
