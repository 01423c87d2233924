"""A place for a result: what is written there appears whole, or not at all."""

import os
import secrets
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from hdcal.errors import Finding, InputError, NotWritable
from hdcal.report.saving.contents import Foreign, Unstamped, result_entries, seal
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


@dataclass(frozen=True)
class Target(ABC):
    """A place that this process alone may write to, while it is used as a context.

    Attributes:
        name: as the user named it.
        path: where that is, links followed.
        lock: held until the context ends.
        existed: whether anything was there when it was reserved.
    """

    name: str
    path: Path
    lock: Lock
    existed: bool

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.lock.release()

    @abstractmethod
    def check(self) -> None:
        """Check that what is there may be replaced.

        Raises:
            Foreign: hdcal did not write it, or not only hdcal.
            OSError: it cannot be read.
        """

    @abstractmethod
    def _replace(self, building: Path) -> Path | None:
        """Put a new result in the place of an older one.

        Returns:
            Where the older one was put if it could not be removed.
        """

    @contextmanager
    def _building(self) -> Iterator[Path]:
        """Yield an empty hidden folder beside the target; at the end it is gone."""
        hidden = f".hdcal-{self.lock.key}-{secrets.token_hex(6)}"
        working = self.path.with_name(hidden)
        try:
            working.mkdir()
            (working / BUILDING).mkdir()
            yield working / BUILDING
        except OSError as error:
            raise not_writable(self.name, error) from error
        finally:
            # What resists is removed at the next start.
            with suppress(OSError):
                finish(working)

    def _publish(self, building: Path) -> None:
        """Give a finished result its name, or one beside it where that is taken."""
        older = None
        try:
            if self.existed and os.path.lexists(self.path):
                self.check()
                older = self._replace(building)
            else:
                rename_new(building, self.path)
        except (FileExistsError, Foreign) as error:
            problem = "appeared while the result was made"
            if isinstance(error, Foreign):
                problem = str(error)
            beside = rename_beside(building, self.path)
            self._confirm()
            problem += f", and was kept; the result lies beside it, in '{beside.name}'"
            raise self._kept(problem) from None
        self._confirm()
        if older is not None:
            problem = "was edited as the result took its place"
            raise self._kept(f"{problem}; what was there lies in '{older.name}'")

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


@dataclass(frozen=True)
class TargetFolder(Target):
    """A place for a result folder.

    Attributes:
        unstamped: tells what is hdcal's in a folder without a stamp.
    """

    unstamped: Unstamped

    @contextmanager
    def filled(self) -> Iterator[Path]:
        """Yield a hidden folder that takes the target's place when all went well.

        An older result stays until the new one is complete. Whatever goes wrong, an
        interruption included, nothing is left behind.

        Raises:
            KeptBeside: the target appeared or was edited meanwhile.
            NotWritable: the disk refused.
        """
        with self._building() as building:
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

    def _replace(self, building: Path) -> Path | None:
        swapping = building.with_name(SWAPPING)
        swapping.mkdir()
        aside = building.rename(swapping / self.path.name)
        if not exchange(aside, self.path):
            # If this process dies between the two, the next start brings it back.
            aside.rename(building)
            self.path.rename(aside)
            rename_new(building, self.path)
        self._confirm()
        with suppress(OSError):  # then the next start removes it
            return remove_result(aside, self.unstamped)
        return None


@dataclass(frozen=True)
class TargetFile(Target):
    """A place for a file of its own.

    Attributes:
        beginning: of the text of a table that may be replaced.
    """

    beginning: str

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
            file = building / self.path.name
            write_file(file, data, mode)
            sync(file)
            self._publish(file)

    def check(self) -> None:
        """Check that it begins as the tables of hdcal do.

        Raises:
            Foreign: it does not.
            OSError: it cannot be read.
        """
        if self.path.is_file():
            with open(self.path, "rb") as table:
                if table.read(len(self.beginning)) == self.beginning.encode():
                    return
        raise Foreign("is no table that hdcal wrote")

    def _replace(self, building: Path) -> None:
        building.replace(self.path)


def not_writable(name: str, error: OSError) -> NotWritable:
    """Return what is said when the disk refuses a result that is being written."""
    words = f"cannot be written ({error.strerror or error}); nothing of it was left"
    remedy = "Check space and permissions, then try again"
    return NotWritable(f"{name}: {words}. {remedy}.")
