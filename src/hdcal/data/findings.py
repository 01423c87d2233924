"""Findings on one file, collected while it is read."""

import re
from collections.abc import Iterable, Sequence
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, shortened

LISTED = 20  # findings that one answer lists
_ROWS = 6  # rows that one sentence lists
_CELL = re.compile(r"'[^']*'")


def row_list(rows: Sequence[int]) -> str:
    """Return a text such as 'rows 3, 5, 9 and 12 more'."""
    return f"row{'' if len(rows) == 1 else 's'} {shortened(rows, _ROWS)}"


class FileFindings(Findings):
    """Findings on one file.

    Args:
        file: its name, as the user gave it.

    Attributes:
        rows: the first finding on each faulty row, also on rows that no sentence lists.
    """

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        self.rows: dict[int, Finding] = {}

    def add(
        self,
        problem: str,
        remedy: str,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        """Add one finding; its parts are those of `Finding`."""
        found = Finding(self.file, problem, remedy, row, column)
        if row is not None:
            self.rows.setdefault(row, found)
        self.append(found)

    def add_rows(
        self, faults: Iterable[tuple[int, str, str]], column: str | None = None
    ) -> None:
        """Add one finding for each kind of fault.

        Args:
            faults: row, problem and remedy of each; problems that differ only in a
                quoted cell are of one kind.
            column: header.
        """
        kinds: dict[str, list[Finding]] = {}
        for row, problem, remedy in faults:
            found = Finding(self.file, problem, remedy, row, column)
            self.rows.setdefault(row, found)
            kinds.setdefault(_CELL.sub("''", problem), []).append(found)
        for first, *others in kinds.values():
            problem = first.problem
            if others:
                rows = row_list([one.row for one in others if one.row is not None])
                count = len(others) + 1
                problem = f"{problem}; the same in {count} rows in all, also {rows}"
            self.add(problem, first.remedy, first.row, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Add a finding after which nothing more can be read.

        Raises:
            InputError: holds every finding.
        """
        self.add(problem, remedy, row)
        raise InputError(self)
