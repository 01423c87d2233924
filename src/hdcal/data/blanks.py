"""Tables with blanks between their columns, as simulations and old loggers write."""

import re

from hdcal.data.table_start import is_number

_GAP = re.compile(r"\s{2,}")
# So many lines of numbers are a table.
_READINGS = 5


def tabbed(utf8: bytes, head: str) -> bytes | None:
    """Return a table of blanks with tabs in their place; None where it is none.

    Args:
        utf8: the whole text.
        head: what it begins with.
    """
    lines = head.split("\n")
    widths = [width for line in lines if (width := _width(line)) > 1]
    if len(widths) < _READINGS or "\t" in head:
        return None
    width = widths[0]
    text = "\n".join(_cells(line, width) for line in utf8.decode().split("\n"))
    return text.encode()


def _width(line: str) -> int:
    """Return how many numbers a line of numbers only holds, between blanks."""
    cells = line.split()
    # A comma at the end of a number separates it from the next.
    whole = all(is_number(cell) and cell == cell.strip(",") for cell in cells)
    return len(cells) if whole else 0


def _cells(line: str, width: int) -> str:
    """Return a line with tabs between its cells, where it has as many as readings."""
    bare = line.strip()
    for cells in (bare.split(), _GAP.split(bare)):
        if len(cells) == width:
            return "\t".join(cells)
    return line
