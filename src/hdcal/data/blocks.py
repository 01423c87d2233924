"""What stands between and below the readings of a file: further blocks, and footers.

A logger that is started again writes its titles and headers again: each block is a run.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hdcal.data.table_start import is_number, is_reading, split_line

# What begins a line below the readings that sums them up.
_SUMMARIES = {
    *("mean", "average", "sum", "total", "sd", "std", "stdev", "std dev", "median"),
    *("standard deviation", "minimum", "maximum", "min", "max", "mittelwert", "summe"),
    *("standardabweichung", "stdabw", "moyenne", "somme", "écart type"),
    *("平均", "平均值", "最大值", "最小值"),
}


class Blocks(NamedTuple):
    """Which lines below the first headers are readings.

    Attributes:
        extra: titles, headers, units and footers, shape (lines,).
        block: number of the block that each line stands in, from 1, shape (lines,).
        titles: lines with something in them above repeated headers.
        footers: the same below the last reading.
    """

    extra: np.ndarray
    block: np.ndarray
    titles: int
    footers: int


def find_blocks(
    text: bytes,
    lines: Sequence[bytes],
    head: bytes,
    units: bytes | None,
    separator: str,
    width: int,
) -> Blocks:
    """Return the blocks of a file.

    Args:
        text: the whole file.
        lines: below the first headers and their units.
        head: the line of those headers; empty without one.
        units: the line of their units, or None.
        separator: of the cells.
        width: cells of a reading.
    """
    titled = _titled(lines, separator, width)
    extra = np.zeros(len(lines), dtype=bool)
    block = np.ones(len(lines), dtype=int)
    wanted, titles = head.strip(), 0
    again = bool(wanted) and text.count(wanted) > 1
    for index, line in enumerate(lines if again else ()):
        if line.strip() != wanted:
            continue
        extra[index] = True
        block[index:] += 1
        if units is not None and lines[index + 1 : index + 2] == [units]:
            extra[index + 1] = True
        above = index - 1
        while above >= 0 and not extra[above] and titled(above):
            extra[above] = True
            titles += bool(lines[above].strip())
            above -= 1
    below = len(lines)
    while below > 0 and _is_footer(lines[below - 1].decode(), separator, width):
        below -= 1
    footers = sum(bool(line.strip()) for line in lines[below:]) if below else 0
    if footers:
        extra[below:] = True
    return Blocks(extra, block, titles, footers)


def with_runs(lines: Sequence[bytes], runs: np.ndarray, separator: str) -> list[bytes]:
    """Return lines with the number of their run as a last cell.

    Args:
        lines: readings.
        runs: of each line, from 1, shape (n,).
        separator: of the cells.
    """
    mark = separator.encode()
    each = zip(lines, runs.tolist(), strict=True)
    return [b"%b%b%d" % (line, mark, run) for line, run in each]


def block_notes(blocks: Blocks, runs: int) -> Iterator[str]:
    """Yield what was made of repeated headers, titles and footers.

    Args:
        blocks: of the file.
        runs: that blocks were made to; 0 where the file names its runs itself.
    """
    many = int(blocks.block[-1])
    if many > 1:
        each = f", above {runs} blocks of readings: each is a run" * (runs > 1)
        yield f"the headers stand {many} times{each}. If not, split the file"
    if blocks.titles:
        yield f"{blocks.titles} lines between the blocks taken for their titles"
    if blocks.footers:
        lines = "line" if blocks.footers == 1 else f"{blocks.footers} lines"
        yield f"the last {lines} taken for no readings"


def _titled(
    lines: Sequence[bytes], separator: str, width: int
) -> Callable[[int], bool]:
    """Return what tells whether a line above repeated headers is a title, or empty.

    A line that begins as readings do is one of them, however it goes on.
    """

    def cells(index: int) -> list[str]:
        return split_line(lines[index].decode(), separator)

    first = next((i for i in range(len(lines)) if is_reading(cells(i), width)), None)
    begins = 0 if first is None else [*map(is_number, cells(first))].index(True)

    def titled(index: int) -> bool:
        found = cells(index)
        if len(found) == width and is_number(found[begins]):
            return False
        if begins > 0 and len(found) == width:
            # Readings begin with a label, as titles do: those hold no number.
            return not any(map(is_number, found))
        return not _counts(next(filter(None, found), ""))

    return titled


def _counts(cell: str) -> bool:
    """Tell whether a cell begins as a number or a time does."""
    return cell.lstrip("+-.,")[:1].isdigit()


def _is_footer(line: str, separator: str, width: int) -> bool:
    """Tell whether a line sums up what is above it, or is a remark.

    A reading that breaks off begins with a number or a time, and is told of as such;
    so is one with a cell too many.
    """
    cells = split_line(line, separator)
    filled = [cell for cell in cells if cell]
    if not filled:
        return True
    if filled[0].strip(" .:").lower() in _SUMMARIES:
        return True
    words = any(letter.isalpha() for letter in filled[0]) and not _counts(filled[0])
    # In a workbook a remark has empty cells beside it.
    other = len(cells) != width or len(filled) == 1
    return words and other and sum(map(is_number, filled)) < 2
