"""Blocks of readings in a grid.

Rows with numbers in every counted column are readings. All other rows stand above,
between and below them: names and units, titles, remarks, summaries, and spoilt
readings, which are kept so that their bad cells become findings.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hdcal.data.findings import FileFindings, row_list
from hdcal.data.tables.cells import are_numbers, is_number
from hdcal.data.tables.grid import Grid, SourceLine
from hdcal.data.tables.headings import Heading, find_heading
from hdcal.errors import quoted

# Rows at the top, and spread over the rest, that show which columns hold numbers.
_SAMPLE = 400
_FEWEST = 5  # rows from which a table of other columns is too large to be passed over
_SUMMARIES = {
    *("mean", "average", "avg", "sum", "total", "sd", "std", "stdev", "std dev"),
    *("median", "cv", "range", "variance", "minimum", "maximum", "min", "max"),
    *("standard deviation", "mittelwert", "summe", "standardabweichung", "stdabw"),
    *("moyenne", "somme", "écart type", "平均", "平均值", "最大值", "最小值"),
}
# Not the errors of spreadsheets: #DIV/0!, #N/A.
_COMMENT = re.compile(r"#(?!(N/A|NV|[A-ZÀ-Ü]+(/0)?[!?])$)|%")


@dataclass(frozen=True)
class ReadTable:
    """Readings of a source."""

    headers: tuple[str, ...]  # with their units, shape (c,)
    header_row: int  # in the source, or that of the first reading
    grid: Grid
    named: bool = True  # whether there is a row of headers
    # Unit that a row of units states against a header, by position.
    conflicts: Mapping[int, str] = field(default_factory=dict)
    unit_row: int | None = None
    empty: frozenset[int] = frozenset()  # positions of columns without any cell
    notes: tuple[str, ...] = ()  # what was assumed
    left_out: tuple[str, ...] = ()  # what was not read
    runs: np.ndarray | None = None  # number of the run by repeated headers, shape (n,)

    @property
    def rows(self) -> np.ndarray:
        """Row of the source of each reading, shape (n,)."""
        return self.grid.rows

    def take(self, kept: np.ndarray) -> "ReadTable":
        """Return the rows that are true in a mask, shape (n,)."""
        runs = None if self.runs is None else self.runs[kept]
        return replace(self, grid=self.grid.take(kept), runs=runs)


class _OtherLines:
    """Sorting of the lines that are no readings."""

    def __init__(self, width: int, counted: list[int]):
        # Cells of a reading, and positions of the columns that hold numbers.
        self._width, self._counted = width, counted
        self.above = 0  # titles above the first reading
        self.spoilt: list[int] = []  # rows of readings with a bad cell
        self.faults: list[tuple[int, str, str]] = []  # row, problem and remedy
        self._left: list[SourceLine] = []

    def sort(
        self, lines: list[SourceLine], *, titled: bool = False, below: bool = False
    ) -> None:
        """Sort lines that a heading follows (titled), or no reading (below)."""
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
            remedy = "Split the file into one file for each table"
            self.faults.append((others[0].row, problem, remedy))
        else:
            self._left += others

    def _is_spoilt(self, line: SourceLine, *, titled: bool) -> bool:
        """Tell whether a line is a reading with a bad cell."""
        if not line.fits or _is_summary(line.first) or _COMMENT.match(line.first):
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
    if _COMMENT.match(line.first) or _is_summary(line.first):
        return True
    if line.counts or (len(line.cells) == 1 and line.first.count('"') % 2):
        return False
    return titled or (below and line.numbers < 2) or line.fits


def _is_summary(cell: str) -> bool:
    """Tell whether a cell begins a line that sums up the readings above it."""
    return cell.strip(" .:").lower() in _SUMMARIES


def find_table(grid: Grid, findings: FileFindings) -> ReadTable:
    """Return the readings of a grid under their headers."""
    sample = _sample(grid)
    counted, empty = _kinds(sample)
    known = _are_readings(sample, counted)
    # The sample begins with all rows at the top.
    first = sample.rows[int(np.argmax(known))] if known.any() else np.inf
    top, body = grid.take(grid.rows < first), grid.take(grid.rows >= first)
    clean = _are_readings(body, counted)
    lines = [*top.lines(), *body.take(~clean).lines(), *grid.loose]
    # Lines that are no readings, by the number of readings above them.
    groups: dict[int, list[SourceLine]] = {0: []}
    for line in sorted(lines):
        above = int(np.searchsorted(body.rows[clean], line.row))
        groups.setdefault(above, []).append(line)
    others = _OtherLines(grid.width, counted)
    headings = [_first_heading(groups.pop(0), grid.width, empty, others, findings)]
    total = int(clean.sum())
    for above, lines in groups.items():
        later = find_heading(lines, grid.width, headings[0])
        if later is None or above == total:
            others.sort(lines, below=above == total)
        else:
            headings.append(later)
            others.sort([line for line in lines if line.row < later.row], titled=True)
            others.sort([line for line in lines if line.row > later.last])
    if others.spoilt and min(others.spoilt) < first:
        body, clean = grid, grid.rows >= first
        clean[clean] = _are_readings(grid.take(clean), counted)
    readings = body.take(clean | np.isin(body.rows, others.spoilt))
    words = "the columns differ from those of the first block"
    remedy = "Use the same columns in the same order, or split the file"
    foreign = [other.row for other in headings if other.names != headings[0].names]
    findings.add_rows([*((row, words, remedy) for row in foreign), *others.faults])
    return _table(readings, headings, empty, others)


def _first_heading(
    lines: list[SourceLine],
    width: int,
    empty: frozenset[int],
    others: _OtherLines,
    findings: FileFindings,
) -> Heading:
    """Return the heading above the first reading; without one columns are numbered."""
    heading = find_heading(lines, width)
    if heading is None:
        words = [i for i, line in enumerate(lines) if not line.counts]
        others.above = max(words, default=-1) + 1
        others.sort(lines[others.above :])
        return Heading(tuple(str(i + 1) for i in range(width)))
    if not empty.issuperset(range(heading.cells, width)):
        words = f"names {heading.cells} columns, but the readings below have {width}"
        findings.refuse(words, "Name every column", heading.row)
    above = {line.row for line in lines if line.row <= heading.last}
    others.above = len(above - {heading.row, heading.unit_row})
    others.sort([line for line in lines if line.row > heading.last])
    return heading


def _sample(grid: Grid) -> Grid:
    place = np.arange(len(grid.rows))
    later = (place - _SAMPLE) % max(1, len(place) // _SAMPLE) == 0
    return grid.take((place < _SAMPLE) | later)


def _kinds(sample: Grid) -> tuple[list[int], frozenset[int]]:
    """Return the columns that hold numbers in most rows, and those without a cell."""
    places, count = range(sample.width), len(sample.rows)
    # Columns that the source itself states to be numbers are not looked at.
    texts = [
        ["0"] * count if sample.is_numeric(place) else sample.texts(place)
        for place in places
    ]
    numbers = np.array([[*map(is_number, cells)] for cells in texts], bool)
    filled = np.array([[*map(bool, cells)] for cells in texts], bool)
    rows = numbers.sum(axis=0) >= min(2, sample.width)
    if not rows.any():
        rows = numbers.any(axis=0)
    share = 2 * numbers[:, rows].sum(axis=1) > filled[:, rows].sum(axis=1)
    counted = [i for i in places if share[i] or sample.is_numeric(i)]
    bare = filled[:, rows].sum(axis=1) == 0
    return counted, frozenset(i for i in places if bare[i] and rows.any())


def _are_readings(grid: Grid, counted: list[int]) -> np.ndarray:
    """Tell which rows have numbers in all counted columns, two at least, (n,)."""
    unsure = [place for place in counted if not grid.is_numeric(place)]
    numbers = np.full(len(grid.rows), len(counted))
    fits = np.full(len(grid.rows), len(counted) > 0)
    for place in unsure:
        cells = grid.read(place)
        if cells.dtype == object:
            held = are_numbers(cells)
            numbers -= ~held
            fits &= held | (cells == "")
    fits &= numbers >= min(2, len(counted))
    if 0 not in counted and unsure:
        fits &= ~_summaries(grid.texts(0))
    return fits


def _summaries(words: list[str]) -> np.ndarray:
    """Tell which rows begin with a word such as Mean, shape (n,).

    One that stands in several rows below each other is a label.
    """
    known = {word for word in {*words} if _is_summary(word)}
    near = zip([None, *words[:-1]], words, [*words[1:], None], strict=False)
    return np.array([word in known and word not in (a, b) for a, word, b in near], bool)


def _table(
    grid: Grid, headings: list[Heading], empty: frozenset[int], others: _OtherLines
) -> ReadTable:
    main, notes = headings[0], []
    if others.above:
        names = ", ".join(f"'{name}'" for name in main.names)
        lines = "1 line" if others.above == 1 else f"{others.above} lines"
        notes.append(f"{lines} above the table read as titles. The columns are {names}")
    if main.unit_row is not None and main.unit_row > main.row:
        notes.append(f"row {main.unit_row} read as the units of the columns")
    if len(headings) > 1:
        notes.append(
            f"the header row is repeated {len(headings)} times. If these are different "
            "tables, split the file"
        )
    block = np.searchsorted([heading.last for heading in headings[1:]], grid.rows)
    runs = np.unique(block, return_inverse=True)[1]
    return ReadTable(
        headers=main.names,
        header_row=main.row or (int(grid.rows[0]) if len(grid.rows) else 1),
        grid=grid,
        named=main.row > 0,
        conflicts=main.conflicts,
        unit_row=main.unit_row,
        empty=empty,
        notes=tuple(notes),
        left_out=others.note,
        runs=runs if runs.any() else None,
    )
