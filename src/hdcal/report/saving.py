"""Results on disk: written to a temporary folder beside the target, then renamed."""

import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Self

from filelock import FileLock, Timeout

from hdcal.data.measurements.gear_files import MARKER
from hdcal.errors import Finding, InputError, NotWritable


@dataclass
class Target:
    """Output folder or file, locked until the context exits.

    `InputError` if it exists, is in use or cannot be written.
    """

    name: str
    # Whether an older result may be replaced, and the parameter that allows it.
    force: bool = False
    option: str = "force"
    # First bytes of a file that may be replaced; None for a folder.
    beginning: bytes | None = None

    def __post_init__(self) -> None:
        self.path = Path(os.path.realpath(self.name))
        self._temporary = self.path.parent / f".hdcal-{self.path.name}.unfinished"
        self._new = self._temporary / "new" / self.path.name
        self._old = self._temporary / "old" / self.path.name
        self._lock = FileLock(self._temporary / "lock", timeout=0)
        try:
            if not self.path.parent.is_dir():
                raise self._refusal("its parent folder does not exist")
            self._temporary.mkdir(exist_ok=True)
            self._lock.acquire()
            self._clean()
            if problem := self._problem():
                raise self._refusal(problem)
            self._new.parent.mkdir()
            self._old.parent.mkdir()
        except BaseException as error:
            self.__exit__()
            if isinstance(error, Timeout):
                raise self._refusal("is being written by another process") from None
            if isinstance(error, OSError):
                raise self._refusal(f"cannot be written ({error})") from error
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        with suppress(OSError):
            if self._lock.is_locked:
                self._clean()
                # Last: once this file is gone, another process may write.
                os.unlink(self._lock.lock_file)
            self._temporary.rmdir()
        self._lock.release()

    @contextmanager
    def filled(self) -> Iterator[Path]:
        """Path of an empty folder, or of a new file, that is renamed at the end.

        Beside the target, if that was created or edited: `InputError`.
        """
        try:
            if self.beginning is None:
                self._new.mkdir()
            yield self._new
            if self.beginning is None:
                marker = {"version": version("hdcal"), "files": _contents(self._new)}
                (self._new / MARKER).write_text(json.dumps(marker, indent=2), "utf-8")
            for file in filter(Path.is_file, (self._new, *self._new.rglob("*"))):
                with open(file, "rb") as stream:
                    os.fsync(stream.fileno())
            if problem := self._problem():
                path = self.path
                others = (path.with_stem(f"{path.stem}-{n}") for n in count(2))
                free = next(other for other in others if not os.path.lexists(other))
                self._new.rename(free)
                raise self._refusal(f"{problem}; the new result is in '{free.name}'")
            if self.path.is_dir():
                self.path.rename(self._old)
            self._new.rename(self.path)
        except OSError as error:
            raise NotWritable(f"{self.name}: cannot be written ({error}).") from error

    def _problem(self) -> str | None:
        """Return why the target must not be replaced, None if it may be."""
        if not os.path.lexists(self.path):
            return None
        if not self.force:
            return f"exists already; `{self.option}` replaces an older result of hdcal"
        if (start := self.beginning) is not None:
            known = self.path.is_file() and self.path.read_bytes().startswith(start)
            return None if known else "was not written by hdcal"
        try:
            files = dict(json.loads((self.path / MARKER).read_text("utf-8"))["files"])
        except (OSError, ValueError, LookupError, TypeError):
            return f"is not a result of hdcal: it has no valid {MARKER}"
        for name, content in _contents(self.path).items():
            if files.get(name) != content and name != MARKER:
                return (
                    f"contains '{name}', which hdcal did not write or which was edited"
                )
        return None

    def _refusal(self, problem: str) -> InputError:
        return InputError([Finding(self.name or ".", problem, "Choose another name")])

    def _clean(self) -> None:
        """Undo an interrupted replacement and remove temporary files."""
        if self._new.exists() and self._old.exists() and not self.path.exists():
            self._old.rename(self.path)
        for part in (self._new.parent, self._old.parent):
            shutil.rmtree(part, ignore_errors=True)


def _contents(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file, or "link" or "folder", by relative path."""
    contents = {}
    for path in sorted(folder.rglob("*")):
        content = "link" if path.is_symlink() else "folder"
        if path.is_file() and content != "link":
            content = hashlib.sha256(path.read_bytes()).hexdigest()
        contents[path.relative_to(folder).as_posix()] = content
    return contents
