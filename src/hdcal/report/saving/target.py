"""A place for a result: what is written there appears whole, or not at all."""

import os
import secrets
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from hdcal.errors import Finding, InputError, NotWritable
from hdcal.report.saving.contents import (
    Foreign,
    Unstamped,
    is_file,
    older_result,
    result_entries,
    seal,
    size_and_sha256,
    write_stamp,
)
from hdcal.report.saving.disk import (
    exchange,
    rename_beside,
    rename_new,
    sync,
    write_file,
)
from hdcal.report.saving.leftovers import BUILDING, SWAPPING, finish, remove_result
from hdcal.report.saving.lock import Lock


class KeptBeside(InputError):
    """The target appeared or was edited meanwhile; one of the two lies beside it."""


@dataclass(eq=False)
class Target(ABC):
    """A place that this process alone may write to, while it is used as a context.

    Attributes:
        name: as the user named it.
        path: where that is, links followed.
        lock: held until the context ends.
        existed: whether anything was there when it was reserved.
        unstamped: tells what is hdcal's in a folder without a stamp.
    """

    name: str
    path: Path
    lock: Lock
    existed: bool
    unstamped: Unstamped = older_result
    _built: os.stat_result | None = field(default=None, init=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind, error: BaseException | None, trace) -> None:
        self.lock.release()
        if isinstance(error, KeyboardInterrupt) and self.written is not None:
            error.add_note(f"{self.name} is written")

    @property
    def written(self) -> Path | None:
        """Return where the result lies, at its place or beside it; None if nowhere.

        The disk says so: an interruption may come in the moment of the rename.
        """
        if self._built is None:
            return None
        with suppress(OSError), os.scandir(self.path.parent) as entries:
            for entry in entries:
                found = entry.stat(follow_symlinks=False)
                if os.path.samestat(found, self._built):
                    return Path(entry.path)
        return None

    @abstractmethod
    def check(self) -> None:
        """Check that what is there may be replaced.

        Raises:
            Foreign: hdcal did not write it, or not only hdcal.
            OSError: it cannot be read.
        """

    @contextmanager
    def _building(self) -> Iterator[Path]:
        """Yield a hidden name for the result; at the end nothing is left of it."""
        hidden = f".hdcal-{self.lock.key}-{secrets.token_hex(6)}"
        working = self.path.with_name(hidden)
        try:
            working.mkdir()
            (working / BUILDING).mkdir()
            yield working / BUILDING / self.path.name
        except OSError as error:
            # Whoever fills it may also read: what else is missing is not its fault.
            if _is_about(error, working, self.path):
                raise not_writable(self.name, error) from error
            raise
        finally:
            # What resists is removed at the next start.
            with suppress(OSError):
                finish(working)

    def _publish(self, building: Path) -> None:
        """Give a finished result its name, or one beside it where that is taken."""
        self._built = building.lstat()
        try:
            kept = self._give_name(building)
        except (FileExistsError, Foreign) as error:
            problem = "appeared while the result was made"
            if isinstance(error, Foreign):
                problem = str(error)
            beside = rename_beside(building, self.path)
            self._confirm()
            problem += f", and was kept; the result lies beside it, in '{beside.name}'"
            raise self._kept(problem) from None
        self._confirm()
        if kept is not None:
            beside, why = kept
            problem = f"{why}; the result took its place"
            raise self._kept(f"{problem}, and what was there lies in '{beside.name}'")

    def _give_name(self, building: Path) -> tuple[Path, str] | None:
        """Give a finished result its name.

        Returns:
            Where an older one was put that could not be removed, and why.
        """
        if self.existed:
            with suppress(FileNotFoundError):  # then it went away
                self.check()
                return self._replace(building)
        rename_new(building, self.path)
        return None

    def _replace(self, building: Path) -> tuple[Path, str] | None:
        """Put a new result in the place of an older one, and remove that.

        Raises:
            FileNotFoundError: there is none any more; nothing has changed.
        """
        swapping = building.parents[1] / SWAPPING
        swapping.mkdir()
        aside = building.rename(swapping / self.path.name)
        try:
            swapped = exchange(aside, self.path)
        except OSError:
            aside.rename(building)  # there it is never taken for the older one
            raise
        if not swapped:
            # If this process dies between the two, the next start brings it back.
            aside.rename(building)
            self.path.rename(aside)
            rename_new(building, self.path)
        self._confirm()
        # What resists stays hidden, whole or not, and is removed at the next start.
        with suppress(OSError):
            return remove_result(aside, self.unstamped)
        return None

    def _confirm(self) -> None:
        """Wait until the disk holds the new name."""
        try:
            sync(self.path.parent)
        except OSError as error:
            words = "is written, but may not outlast a loss of power"
            reason = error.strerror or error
            raise NotWritable(f"{self.name}: {words} ({reason}).") from error

    def _kept(self, problem: str) -> KeptBeside:
        return KeptBeside([Finding(self.name, problem, "Compare the two")])


class TargetFolder(Target):
    """A place for a result folder."""

    @contextmanager
    def filled(self) -> Iterator[Path]:
        """Yield a hidden folder that takes the target's place when all went well.

        An older result stays until the new one is complete. Whatever goes wrong, an
        interruption included, nothing is left behind that is not whole.

        Raises:
            KeptBeside: the target appeared or was edited meanwhile.
            NotWritable: the disk refused.
        """
        with self._building() as building:
            building.mkdir()
            yield building
            seal(building)
            self._publish(building)

    def check(self) -> None:
        """Check that it holds nothing but a result of hdcal.

        Raises:
            Foreign: it does.
            OSError: it cannot be read.
        """
        result_entries(self.path, self.unstamped)


@dataclass(eq=False, kw_only=True)
class TargetFile(Target):
    """A place for a file of its own.

    Attributes:
        beginning: of a file that may be replaced.
    """

    beginning: bytes
    # Size and SHA-256 of the table that was there when the place was reserved.
    _older: tuple[int, str] | None = field(default=None, init=False)

    def write(self, data: bytes, mode: int = 0o666) -> None:
        """Write the file whole, or not at all.

        Args:
            data: its content.
            mode: its permissions, of which the process's mask takes some away.

        Raises:
            KeptBeside: the target appeared or was edited meanwhile.
            NotWritable: the disk refused.
        """
        with self._building() as building:
            write_file(building, data, mode)
            sync(building)
            if self._older is not None:
                # By this either is known after the swap.
                both = {"older": self._older, "newer": size_and_sha256(building)}
                write_stamp(building.parents[1], both)
            self._publish(building)

    def check(self) -> None:
        """Check that it begins as the tables of hdcal do, and is as it was before.

        Raises:
            Foreign: it does not, or is not.
            OSError: it cannot be read.
        """
        begins = _first(self.path, len(self.beginning)) if is_file(self.path) else None
        if begins != self.beginning:
            raise Foreign("is no table that hdcal wrote")
        found = size_and_sha256(self.path)
        if self._older not in (None, found):
            raise Foreign("was edited while the result was made")
        self._older = found


def _first(path: Path, count: int) -> bytes:
    with open(path, "rb") as stream:
        return stream.read(count)


def _is_about(error: OSError, *places: Path) -> bool:
    """Tell whether an error is about something in one of some places.

    One without a name is taken for it: so the system tells of a write.
    """
    given = (error.filename, error.filename2)
    named = [Path(os.fsdecode(name)) for name in given if isinstance(name, str | bytes)]
    return not named or any(p.is_relative_to(place) for p in named for place in places)


def not_writable(name: str, error: OSError) -> NotWritable:
    """Return what is said when the disk refuses a result that is being written."""
    words = f"cannot be written ({error.strerror or error}); nothing of it was left"
    remedy = "Check space and permissions, then try again"
    return NotWritable(f"{name}: {words}. {remedy}.")
