"""What is wrong with one file, collected while it is read."""

from collections.abc import Iterable, Sequence
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, quoted

LISTED = 20  # findings of one kind that are spelled out before "and N more"


# Row, problem and remedy.
_Found = tuple[int, str, str]


def _blocks(
    found: Sequence[_Found], places: Sequence[tuple[str, int]]
) -> list[list[_Found]]:
    """Return findings with those of the row above that say the same beside them."""
    blocks: list[list[_Found]] = []
    for one in found:
        above = blocks[-1][-1] if blocks else (-1, "", "")
        below = above[0] == one[0] - 1 and above[1:] == one[1:]
        if below and (not places or places[above[0] - 1][0] == places[one[0] - 1][0]):
            blocks[-1].append(one)
        else:
            blocks.append([one])
    return blocks


class FileFindings(Findings):
    """Findings about one file, so that a user sees all of them at once.

    Args:
        file: how the user named it.

    Attributes:
        places: sheet and row of each row of a table that was joined from several
            sheets; empty of any other.
        rows: problem, remedy and column of the first thing that is wrong with each row,
            those that are not spelled out among them.
    """

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        self.places: Sequence[tuple[str, int]] = ()
        self.rows: dict[int, tuple[str, str, str | None]] = {}

    def row_of_file(self, row: int) -> int:
        """Return where a row of the text stands in the file, or in its sheet."""
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
        """Return the first thing that is wrong with a row of the text."""
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
        self,
        found: Iterable[tuple[int, str, str]],
        column: str | None = None,
        kind: str = "rows like these",
    ) -> None:
        """Add findings of one kind: the first 20, then how many more there are.

        Where there are more, rows below each other that lack the same are told as one.

        Args:
            found: row, problem and remedy of each.
            column: header.
            kind: what they are, in the plural.
        """
        every = [*found]
        for row, problem, remedy in every:
            self.rows.setdefault(row, (problem, remedy, column))
        blocks = [[one] for one in every]
        if len(every) > LISTED:
            blocks = _blocks(every, self.places)
        for block in blocks[:LISTED]:
            row, problem, remedy = block[0]
            if len(block) > 1:
                last = self.row_of_file(block[-1][0])
                problem = f"{problem}; the same in all rows down to {last}"
            self.add(problem, remedy, row, column)
        if more := sum(map(len, blocks[LISTED:])):
            self.add(f"and {more} more {kind}", "Mend all of them", None, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Add one finding, after which nothing more can be read.

        Raises:
            InputError: holds every finding.
        """
        self.add(problem, remedy, row)
        raise InputError(self)
