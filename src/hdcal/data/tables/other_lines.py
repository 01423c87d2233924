"""Lines of a source that are no readings: titles, remarks, summaries."""

import re

from hdcal.data.findings import row_list
from hdcal.data.tables.cells import is_number
from hdcal.data.tables.grid import SourceLine
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

    Attributes:
        above: number of titles above the first reading.
        spoilt: rows of readings with a bad cell.
        faults: row, problem and remedy of each line that is wrong.
    """

    def __init__(self, width: int, counted: list[int]):
        self._width, self._counted, self.above = width, counted, 0
        self.spoilt: list[int] = []
        self.faults: list[tuple[int, str, str]] = []
        self._left: list[SourceLine] = []

    def sort(
        self, lines: list[SourceLine], *, titled: bool = False, below: bool = False
    ) -> None:
        """Sort the lines between two readings.

        Args:
            lines: in their order.
            titled: whether a heading follows them.
            below: whether no reading follows.
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
                self._refuse(line)
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

    def _refuse(self, line: SourceLine) -> None:
        """Add the fault of a line that has another number of cells."""
        problem = f"has {len(line.cells)} cells where the header row has {self._width}"
        remedy = f"Write {self._width} cells, or remove the line"
        if '"' in line.first:
            remedy += "; close each quotation mark"
        elif len(line.cells) > self._width:
            remedy += "; with decimal commas separate the columns by semicolons"
        self.faults.append((line.row, problem, remedy))

    @property
    def note(self) -> tuple[str, ...]:
        """A note on lines that are not read, if there are some."""
        if not self._left:
            return ()
        rows = row_list(sorted(line.row for line in self._left))
        return (f"no readings: {rows}, as {quoted(self._left[0].first)}",)


def _is_remark(line: SourceLine, *, titled: bool, below: bool) -> bool:
    """Tell whether a line is words, which may stand at this place."""
    if _COMMENT.match(line.first) or is_summary(line.first):
        return True
    if line.counts or (len(line.cells) == 1 and line.first.count('"') % 2):
        return False
    return titled or (below and line.numbers < 2) or line.fits
