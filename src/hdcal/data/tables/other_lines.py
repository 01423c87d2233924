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
    """Tell whether a cell begins a line that sums up what is above it."""
    return cell.strip(" .:").lower() in _SUMMARIES


def _is_open(line: SourceLine) -> bool:
    """Tell whether a quotation mark is not closed."""
    return len(line.cells) == 1 and line.cells[0].count('"') % 2 == 1


class OtherLines:
    """Sorting of the lines that are no readings.

    Args:
        width: cells of a reading.
        counted: positions of the columns that hold numbers.
        findings: of the source.

    Attributes:
        spoilt: rows of readings with a bad cell.
        repeated: number of headings above the first reading, but for one.
        above: number of lines above the headings.
        titles: number of lines above later headings.
        footers: number of lines below the readings.
    """

    def __init__(self, width: int, counted: list[int], findings: FileFindings):
        self._width, self._counted, self._findings = width, counted, findings
        self.spoilt: list[int] = []
        self._wrong: list[tuple[int, str, str]] = []
        self.repeated = self.above = self.titles = self.footers = 0
        self._remarks: list[SourceLine] = []
        self._other_tables: list[int] = []

    def sort_above(
        self, lines: list[SourceLine], heading: Heading | None
    ) -> list[Heading]:
        """Sort the lines above the first reading, and return the first heading.

        Without one, columns are called by their numbers.
        """
        if heading is None:
            words = [i for i, line in enumerate(lines) if not line.counts]
            begin = max(words, default=-1) + 1
            if begin and _is_open(lines[begin - 1]):
                words = "a quotation mark is not closed"
                self._findings.refuse(words, "Close it", lines[begin - 1].row)
            self.above = begin
            self.sort(lines[begin:], top=True)
            return [Heading(tuple(str(i + 1) for i in range(self._width)))]
        known = heading.row, heading.unit_row
        above = [one for one in lines if one.row <= heading.last]
        again = [one for one in above if tuple(one.cells) == heading.bare]
        self.repeated = len(again) - 1 if len(again) > 1 else 0
        self.above = len({one.row for one in above} - {*known}) - self.repeated
        self.sort([line for line in lines if line.row > heading.last], top=True)
        return [heading]

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
            elif self._is_remark(line, titled=titled, below=below):
                self.titles += titled
                self.footers += below
                if not (titled or below):
                    self._remarks.append(line)
            else:
                self.refuse_line(line, top=top)
            words = words if line.counts else len(line.cells)
        if len(others) >= _FEWEST:
            words = "a second table with other columns begins here"
            self._wrong.append((others[0].row, words, "Split the file: one table each"))
        elif others:
            self._other_tables += [line.row for line in others]

    def _is_spoilt(self, line: SourceLine, *, titled: bool) -> bool:
        """Tell whether a line is a reading, though one with a bad cell."""
        if not line.fits or is_summary(line.first) or _COMMENT.match(line.first):
            return False
        cells = [line.cells[place] for place in self._counted]
        if titled:
            # Titles may hold numbers too; they begin with words.
            return is_number(cells[0])
        return any(map(is_number, cells)) or all(cells)

    def _is_remark(self, line: SourceLine, *, titled: bool, below: bool) -> bool:
        """Tell whether a line is words, which may stand where it does."""
        if _COMMENT.match(line.first) or is_summary(line.first):
            return True
        if line.counts or _is_open(line):
            return False
        return titled or (below and line.numbers < 2) or line.fits

    def refuse_line(self, line: SourceLine, *, top: bool = False) -> None:
        """Add what is wrong with a line that has another number of cells."""
        words = f"has {len(line.cells)} cells where the header row has {self._width}"
        remedy = f"Write {self._width} cells"
        if _is_open(line):
            words, remedy = "a quotation mark is not closed", "Close it"
        elif len(line.cells) > self._width:
            remedy += "; with decimal commas separate the columns by semicolons"
        remedy += ", or remove the line" if top else ""
        self._wrong.append((line.row, words, remedy))

    def add_findings(self) -> int:
        """Add what is wrong with lines, and return with how many."""
        self._findings.add_rows(self._wrong)
        return len(self._wrong)

    def left_out(self) -> Iterator[str]:
        """Yield what is passed over."""
        if self._remarks:
            rows = row_list([line.row for line in self._remarks])
            yield f"no readings: {rows}, as {quoted(self._remarks[0].first)}"
        if self._other_tables:
            rows = row_list(self._other_tables)
            yield f"a table of other columns is not read: {rows}"

    def assumed(self, heading: Heading, headings: int) -> Iterator[str]:
        """Yield what was assumed of the lines.

        Args:
            heading: of the first block.
            headings: how many there are.
        """
        if self.above:
            lines = "1 line" if self.above == 1 else f"{self.above} lines"
            names = ", ".join(map(quoted, heading.names))
            yield f"{lines} above the table taken for titles. Its columns: {names}"
        if heading.unit_row is not None and heading.unit_row > heading.row:
            row = self._findings.row_of_file(heading.unit_row)
            yield f"row {row} taken for the units of the columns"
        headings += self.repeated
        if headings > 1:
            yield f"the headers stand {headings} times. If not, split the file"
        if self.titles:
            lines = "1 line" if self.titles == 1 else f"{self.titles} lines"
            yield f"{lines} between the blocks taken for their titles"
        if self.footers:
            lines = "line" if self.footers == 1 else f"{self.footers} lines"
            yield f"the last {lines} taken for no readings"
