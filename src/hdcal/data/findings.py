"""What is wrong with one file, collected while it is read."""

from collections.abc import Iterable, Sequence
from typing import NoReturn

from hdcal.errors import Finding, Findings, InputError, quoted

LISTED = 20  # findings of one kind that are spelled out before "and N more"


class FileFindings(Findings):
    """Findings about one file, so that a user sees all of them at once.

    Args:
        file: how the user named it.

    Attributes:
        places: sheet and row of each row of a table that was joined from several
            sheets; empty of any other.
    """

    def __init__(self, file: str):
        super().__init__()
        self.file = file
        self.places: Sequence[tuple[str, int]] = ()

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
        file = self.file
        if self.places and row is not None:
            sheet, row = self.places[row - 1]
            file = f"{file}, sheet {quoted(sheet)}"
        self.append(Finding(file, problem, remedy, row, column))

    def add_rows(
        self,
        found: Iterable[tuple[int, str, str]],
        column: str | None = None,
        kind: str = "rows like these",
    ) -> None:
        """Add findings of one kind: the first 20, then how many more there are.

        Args:
            found: row, problem and remedy of each.
            column: header.
            kind: what they are, in the plural.
        """
        count = 0
        for count, (row, problem, remedy) in enumerate(found, 1):
            if count <= LISTED:
                self.add(problem, remedy, row, column)
        if count > LISTED:
            words = f"and {count - LISTED} more {kind}"
            self.add(words, "Mend all of them", None, column)

    def refuse(self, problem: str, remedy: str, row: int | None = None) -> NoReturn:
        """Add one finding, after which nothing more can be read.

        Raises:
            InputError: holds every finding.
        """
        self.add(problem, remedy, row)
        raise InputError(self)
