"""Findings on one file, collected while it is read."""

import re
from collections.abc import Iterable, Sequence
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, quoted

LISTED = 20  # findings that are spelled out before "and N more"
_FIRST_FEW = 6  # rows that one sentence lists
_CELL = re.compile(r"'[^']*'")


def row_list(rows: Sequence[int]) -> str:
    """Return a text such as 'rows 3, 5, 9 and 12 more'."""
    few = ", ".join(map(str, rows[:_FIRST_FEW]))
    more = len(rows) - _FIRST_FEW
    few += f" and {more} more" if more > 0 else ""
    return f"row {few}" if len(rows) == 1 else f"rows {few}"


class FileFindings(Findings):
    """Findings about one file, so that a user sees all of them at once.

    Args:
        file: how the user named it.

    Attributes:
        places: sheet and row of each row of a table that was joined from several
            sheets; empty of any other.
        rows: problem, remedy and column of the first thing that is wrong with each row,
            also of rows that no sentence lists.
    """

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        self.places: Sequence[tuple[str, int]] = ()
        self.rows: dict[int, tuple[str, str, str | None]] = {}

    def row_of_file(self, row: int) -> int:
        """Return where a row of the table stands in the file, or in its sheet."""
        return self.places[row - 1][1] if self.places else row

    def add(
        self,
        problem: str,
        remedy: str,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        """Add one finding; its parts are those of `Finding`."""
        if row is not None:
            self.rows.setdefault(row, (problem, remedy, column))
        self.append(self._finding(problem, remedy, row, column))

    def of_row(self, row: int) -> Finding:
        """Return the first thing that is wrong with a row of the table."""
        problem, remedy, column = self.rows[row]
        return self._finding(problem, remedy, row, column)

    def _finding(
        self, problem: str, remedy: str, row: int | None, column: str | None
    ) -> Finding:
        file = self.file
        if self.places and row is not None:
            sheet, row = self.places[row - 1]
            file = f"{file}, sheet {quoted(sheet)}"
        return Finding(file, problem, remedy, row, column)

    def add_rows(
        self, found: Iterable[tuple[int, str, str]], column: str | None = None
    ) -> None:
        """Add one finding for all rows of which the same is wrong.

        Args:
            found: row, problem and remedy of each; problems that differ in a cell that
                they quote are the same.
            column: header.
        """
        alike: dict[str, list[tuple[int, str, str]]] = {}
        for row, problem, remedy in found:
            self.rows.setdefault(row, (problem, remedy, column))
            kind = _CELL.sub("''", problem)
            alike.setdefault(kind, []).append((row, problem, remedy))
        for (row, problem, remedy), *others in alike.values():
            if others:
                rows = row_list([self.row_of_file(one) for one, *_ in others])
                count = len(others) + 1
                problem = f"{problem}; the same in {count} rows in all, also {rows}"
            self.add(problem, remedy, row, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Add one finding, after which nothing more can be read.

        Raises:
            InputError: holds every finding.
        """
        self.add(problem, remedy, row)
        raise InputError(self)
