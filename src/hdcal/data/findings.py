"""Findings on one file, collected while it is read."""

import re
from collections.abc import Iterable, Sequence
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, quoted, shortened

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
        places: sheet and row of each row of a table that was joined from several
            sheets; empty of any other.
        rows: problem, remedy and column of the first fault of each faulty row,
            also of rows that no sentence lists.
    """

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        self.places: Sequence[tuple[str, int]] = ()
        self.rows: dict[int, tuple[str, str, str | None]] = {}

    def row_of_file(self, row: int) -> int:
        """Return the row of the file, or of its sheet, of a row of the table."""
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
        """Return the first fault of a row of the table."""
        problem, remedy, column = self.rows[row]
        return self._finding(problem, remedy, row, column)

    def add_rows(
        self, faults: Iterable[tuple[int, str, str]], column: str | None = None
    ) -> None:
        """Add one finding for each kind of fault.

        Args:
            faults: row, problem and remedy of each; problems that differ only in a
                quoted cell are of one kind.
            column: header.
        """
        alike: dict[str, list[tuple[int, str, str]]] = {}
        for row, problem, remedy in faults:
            self.rows.setdefault(row, (problem, remedy, column))
            kind = _CELL.sub("''", problem)
            alike.setdefault(kind, []).append((row, problem, remedy))
        for (row, problem, remedy), *others in alike.values():
            if others:
                rows = row_list([self.row_of_file(row) for row, *_ in others])
                count = len(others) + 1
                problem = f"{problem}; the same in {count} rows in all, also {rows}"
            self.add(problem, remedy, row, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Add a finding after which nothing more can be read.

        Raises:
            InputError: holds every finding.
        """
        self.add(problem, remedy, row)
        raise InputError(self)

    def _finding(
        self, problem: str, remedy: str, row: int | None, column: str | None
    ) -> Finding:
        file = self.file
        if self.places and row is not None:
            sheet, row = self.places[row - 1]
            file = f"{file}, sheet {quoted(sheet)}"
        return Finding(file, problem, remedy, row, column)
