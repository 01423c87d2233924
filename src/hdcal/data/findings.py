"""Findings on one file, collected while it is read."""

import re
import stat
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, shortened

LISTED = 20  # findings that one answer lists
_ROWS = 6  # rows that one sentence lists
_UNITS = {1 << 10: "KiB", 1 << 20: "MiB", 1 << 30: "GiB"}
_CELL = re.compile(r"'[^']*'")


def row_list(rows: Sequence[int]) -> str:
    """Return a text such as 'rows 3, 5, 9 and 12 more'."""
    return f"row{'' if len(rows) == 1 else 's'} {shortened(rows, _ROWS)}"


class FileFindings(Findings):
    """Findings on one file."""

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        # The first one on each faulty row, also on rows that no sentence lists.
        self.rows: dict[int, Finding] = {}

    def add(
        self,
        problem: str,
        remedy: str,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        """Add one finding; its parts are those of `Finding`."""
        finding = Finding(self.file, problem, remedy, row, column)
        if row is not None:
            self.rows.setdefault(row, finding)
        self.append(finding)

    def add_rows(
        self, faults: Iterable[tuple[int, str, str]], column: str | None = None
    ) -> None:
        """Add one finding for each kind of fault: row, problem and remedy.

        Problems that differ only in a quoted cell are of one kind.
        """
        kinds: dict[str, list[Finding]] = {}
        for row, problem, remedy in faults:
            finding = Finding(self.file, problem, remedy, row, column)
            self.rows.setdefault(row, finding)
            kinds.setdefault(_CELL.sub("''", problem), []).append(finding)
        for first, *others in kinds.values():
            problem = first.problem
            if others:
                rows = row_list(
                    [other.row for other in others if other.row is not None]
                )
                count = len(others) + 1
                problem = f"{problem}; the same in {count} rows in total, also {rows}"
            self.add(problem, first.remedy, first.row, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Raise InputError with this finding after all others."""
        self.add(problem, remedy, row)
        raise InputError(self)


def why_not_readable(path: Path, largest: int) -> tuple[str, str] | None:
    """Return problem and remedy of a file that is endless or too large."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    if stat.S_ISDIR(status.st_mode):
        return "is a folder", "Give a file in it"
    if not stat.S_ISREG(status.st_mode):
        return "is a pipe or a device, not a file", "Write the data to a file first"
    if status.st_size > largest:
        unit = max(one for one in _UNITS if largest >= one)
        words = f"is larger than {largest // unit} {_UNITS[unit]}"
        return words, "Reduce the number of readings"
    return None


def did_you_mean(name: str, known: list[str]) -> str:
    """Return a remedy with the likeliest meaning of an unknown name, and all known."""
    by_lower = {item.lower(): item for item in known}
    near = get_close_matches(name.lower(), by_lower, 1, 0.5)
    hint = f"Did you mean '{by_lower[near[0]]}'? " if near else ""
    return f"{hint}Known names: {', '.join(known)}"
