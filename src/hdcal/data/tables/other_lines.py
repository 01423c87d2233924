"""Lines of a source that are no readings: titles, remarks, summaries."""

import re
from collections.abc import Iterator

from hdcal.data.findings import FileFindings, row_list
from hdcal.data.tables.cells import is_number
from hdcal.data.tables.grid import SourceLine
from hdcal.data.tables.headings import Heading
from hdcal.errors import quoted

# Rows from which a table of other columns is too large to be passed over.
_FEWEST = 5
_SUMMARIES = {
    *("mean", "average", "avg", "sum", "total", "sd", "std", "stdev", "std dev"),
    *("median", "cv", "range", "variance", "minimum", "maximum", "min", "max"),
    *("standard deviation", "mittelwert", "summe", "standardabweichung", "stdabw"),
    *("moyenne", "somme", "écart type", "平均", "平均值", "最大值", "最小值"),
}
_COMMENT = re.compile(r"[#%]")


def is_summary(cell: str) -> bool:
    """Tell whether a cell begins a line that sums up the readings above it."""
    return cell.strip(" .:").lower() in _SUMMARIES


class OtherLines:
    """Sorting of the lines that are no readings.

    Args:
        width: cells of a reading.
        counted: positions of the columns that hold numbers.
        findings: findings on the source.

    Attributes:
        spoilt: rows of readings with a bad cell.
        faults: row, problem and remedy of each line that is wrong.
    """

    def __init__(self, width: int, counted: list[int], findings: FileFindings):
        self._width, self._counted, self._findings = width, counted, findings
        self.spoilt: list[int] = []
        self.faults: list[tuple[int, str, str]] = []
        # Numbers of further headings and of titles above the first reading.
        self._repeated = self._above = 0
        self._left: list[SourceLine] = []

    def sort_above(self, lines: list[SourceLine], heading: Heading | None) -> Heading:
        """Sort the lines above the first reading, and return the first heading.

        Without one, columns are called by their numbers.
        """
        if heading is None:
            words = [i for i, line in enumerate(lines) if not line.counts]
            self._above = max(words, default=-1) + 1
            if words and _is_open(lines[words[-1]]):
                problem = "a quotation mark is not closed"
                self._findings.refuse(problem, "Close it", lines[words[-1]].row)
            self.sort(lines[self._above :], top=True)
            return Heading(tuple(str(i + 1) for i in range(self._width)))
        above = [line for line in lines if line.row <= heading.last]
        names = sum(tuple(line.cells) == heading.bare for line in above)
        self._repeated = max(names - 1, 0)
        others = {line.row for line in above} - {heading.row, heading.unit_row}
        self._above = len(others) - self._repeated
        self.sort([line for line in lines if line.row > heading.last], top=True)
        return heading

    def sort(
        self,
        lines: list[SourceLine],
        *,
        titled: bool = False,
        below: bool = False,
        top: bool = False,
    ) -> None:
        """Sort the lines between two readings, or below the last one.

        Args:
            lines: in their order.
            titled: a heading follows them.
            below: no reading follows.
            top: no reading stands above them.
        """
        words, others = 0, []
        for line in lines:
            if self._is_spoilt(line, titled=titled):
                self.spoilt.append(line.row)
            elif line.counts and not line.fits and len(line.cells) == words > 1:
                others.append(line)
            elif _is_remark(line, titled=titled, below=below):
                self._left.append(line)
            else:
                self._refuse(line, top=top)
            words = words if line.counts else len(line.cells)
        if len(others) >= _FEWEST:
            problem = "a second table with other columns begins here"
            remedy = "Split the file: one table each"
            self.faults.append((others[0].row, problem, remedy))
        else:
            self._left += others

    def _is_spoilt(self, line: SourceLine, *, titled: bool) -> bool:
        """Tell whether a line is a reading with a bad cell."""
        if not line.fits or is_summary(line.first) or _COMMENT.match(line.first):
            return False
        cells = [line.cells[place] for place in self._counted]
        if titled:
            # Titles may hold numbers too; they begin with words.
            return is_number(cells[0])
        return any(map(is_number, cells)) or all(cells)

    def _refuse(self, line: SourceLine, *, top: bool) -> None:
        """Add the fault of a line that has another number of cells."""
        problem = f"has {len(line.cells)} cells where the header row has {self._width}"
        remedy = f"Write {self._width} cells"
        if _is_open(line):
            problem, remedy = "a quotation mark is not closed", "Close it"
        elif len(line.cells) > self._width:
            remedy += "; with decimal commas separate the columns by semicolons"
        remedy += ", or remove the line" if top else ""
        self.faults.append((line.row, problem, remedy))

    def left_out(self) -> Iterator[str]:
        """Yield notes on lines that are not read."""
        if self._left:
            rows = row_list(sorted(line.row for line in self._left))
            yield f"no readings: {rows}, as {quoted(self._left[0].first)}"

    def assumed(self, heading: Heading, headings: int) -> Iterator[str]:
        """Yield notes on what was assumed."""
        if self._above:
            names = ", ".join(map(quoted, heading.names))
            lines = "1 line" if self._above == 1 else f"{self._above} lines"
            yield f"{lines} above the table taken for titles. Its columns: {names}"
        if heading.unit_row is not None and heading.unit_row > heading.row:
            yield f"row {heading.unit_row} taken for the units of the columns"
        if headings + self._repeated > 1:
            times = headings + self._repeated
            yield f"the headers stand {times} times. If not, split the file"


def _is_open(line: SourceLine) -> bool:
    """Tell whether a quotation mark is not closed."""
    return len(line.cells) == 1 and line.cells[0].count('"') % 2 == 1


def _is_remark(line: SourceLine, *, titled: bool, below: bool) -> bool:
    """Tell whether a line is words, which may stand at this place."""
    if _COMMENT.match(line.first) or is_summary(line.first):
        return True
    if line.counts or _is_open(line):
        return False
    return titled or (below and line.numbers < 2) or line.fits
