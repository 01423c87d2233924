"""From the bytes of a text to a grid of cells: encoding, separator, lines."""

import codecs
import re
from collections import Counter
from pathlib import Path

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.cells import is_number
from hdcal.data.tables.grid import SEPARATORS, Grid, SourceLine, split_line

LARGEST_FILE = 1 << 30
_LONGEST_LINE = 1 << 20
# Encodings that test machines write other than Unicode: Western Europe, China, Japan.
_ENCODINGS = ("cp1252", "gb18030", "cp932")
# Signs and letters of Western languages; Chinese read as cp1252 has others.
_WESTERN = {*"°µ²³·–äöüßÄÖÜéèêëàâçùûîïôÉÈÊÀÇñóíá"}
_JUDGED = 50  # lines beyond ASCII by which the encoding is judged
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_HTML = re.compile(
    r"\s*<(!doctype html|html|table|head|body|\?xml[^>]*>\s*<html)", re.I
)
# Lines at the top, and spread over the rest, by which the separator is judged.
_SAMPLE = 300
# Cells by which a line of headers may be longer than the readings below it: remarks.
_MOST_REMARKS = 2
_FEWEST = 5  # lines of numbers between blanks that make a table
_BLANKS = ' \t;,|"'  # characters of an empty line
_MARK = re.compile(r"\s*[#%*/]+\s*")
_GAP = re.compile(r"\s{2,}")


def read_bytes(path: Path, findings: FileFindings, *, wide: bool) -> bytes:
    """Return the bytes of a text without binary content or endless lines."""
    raw = path.read_bytes()
    if not (wide or raw.startswith(_WIDE_MARKS)) and b"\0" in raw:
        findings.refuse("is a binary file", "Save it as UTF-8 text")
    for row, line in enumerate(raw.splitlines(), 1):
        if len(line) > _LONGEST_LINE:
            words = "has a line of more than 1 MiB, so it is not a table of readings"
            findings.refuse(words, "Write one row of readings per line", row)
    return raw


def decode(
    raw: bytes, findings: FileFindings, encoding: str | None
) -> tuple[str, list[str]]:
    """Return a text with plain newlines, and notes on its encoding."""
    likely = encoding or _likely(raw)
    try:
        text = raw.decode(likely)
    except LookupError:
        remedy = "Give one that Python knows, such as cp1252 or gb18030"
        findings.refuse(f"the `encoding` '{encoding}' is unknown", remedy)
    except UnicodeError:
        remedy = "Save it as UTF-8 text, or state its `encoding`"
        findings.refuse(f"is not valid {likely.upper()} text", remedy)
    if "\0" in text:
        findings.refuse("is a binary file", "Save it as UTF-8 text")
    if _HTML.match(text[:1000]):
        words = "is a web page (HTML), despite its file name"
        findings.refuse(words, "Open it in a spreadsheet, save it as .xlsx or CSV")
    text = text.removeprefix("\ufeff")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if encoding or likely in ("utf-8", "utf-16"):
        return text, []
    return text, [f"the text encoding is {likely}. If not, state it: --encoding NAME"]


def _likely(raw: bytes) -> str:
    if raw.startswith(_WIDE_MARKS):
        return "utf-16"
    try:
        raw.decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
    # Degrees and micrometres alone look like Chinese by the count of letters.
    signs = raw.decode("cp1252", errors="replace")
    if {sign for sign in signs if not sign.isascii()} <= _WESTERN:
        return "cp1252"
    import charset_normalizer

    lines = [line for line in raw.splitlines() if not line.isascii()]
    best = charset_normalizer.from_bytes(
        b"\n".join(lines[:_JUDGED]), cp_isolation=list(_ENCODINGS)
    ).best()
    return best.encoding if best is not None else _ENCODINGS[0]


def text_grid(text: str) -> tuple[Grid, list[str]]:
    """Return the grid of a text, and notes on what was assumed.

    The separator is that of most lines of numbers; without such lines, that of the
    first line.
    """
    lines, notes = text.split("\n"), []
    separator, width = _dialect(lines)
    if separator == " ":
        notes.append("the columns are separated by blanks")
        lines, separator = [_tabbed(line, width) for line in lines], "\t"
    if not separator:
        first = next((line for line in lines if line.strip()), "")
        # A semicolon or a tab is never part of a number; a comma may be one.
        separator = max(";\t", key=first.count)
        separator = separator if separator in first else ","
        width = len(split_line(first, separator))
    quoted = '"' in text
    counts = np.array([_count(line, separator) for line in lines])
    filled = np.array([bool(line.strip(_BLANKS)) for line in lines])
    widest = _heading_width(lines, separator, counts, width)
    fits = filled & (counts >= width) & (counts <= widest)
    loose = tuple(
        SourceLine(row + 1, _cells_of(lines[row], separator), fits=False)
        for row in np.flatnonzero(filled & ~fits).tolist()
    )
    rows = np.flatnonzero(fits)
    padded = [lines[r] + separator * int(widest - counts[r]) for r in rows.tolist()]
    if quoted:
        flat = [cell for line in padded for cell in split_line(line, separator)]
    else:
        flat = [cell.strip() for cell in separator.join(padded).split(separator)]
    columns = [np.array(flat[place::widest], object) for place in range(widest)]
    columns = columns if padded else [np.array([], object)] * widest
    return Grid(rows + 1, columns, loose, separator), notes


def _count(line: str, separator: str) -> int:
    """Return the number of cells of a line; 0 where a quotation mark stays open."""
    if '"' not in line:
        return line.count(separator) + 1
    return 0 if line.count('"') % 2 else len(split_line(line, separator))


def _cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line, or the line where a quotation mark stays open."""
    return [line] if line.count('"') % 2 else split_line(line, separator)


def _dialect(lines: list[str]) -> tuple[str, int]:
    """Return the separator with which most lines hold numbers, and their cells.

    The separator is empty where no line holds two numbers, a blank for any blanks.
    """
    step = max(1, len(lines) // _SAMPLE)
    sample = (*lines[:_SAMPLE], *lines[_SAMPLE::step])
    sample = [line for line in sample if line.strip()]
    tabs = any("\t" in line.strip() for line in sample)
    most, best = 0, ("", 0)
    for separator in SEPARATORS if tabs else SEPARATORS + " ":
        parted = (_numbers(_parted(line, separator)) for line in sample)
        shares = [share for share in parted if share is not None]
        if not shares or (separator == " " and len(shares) < _FEWEST):
            continue
        width, count = Counter(cells for cells, _ in shares).most_common(1)[0]
        if count > most:
            most, best = count, (separator, width)
    return best


def _numbers(cells: list[str]) -> tuple[int, float] | None:
    """Return cells and share of numbers of a line; None with fewer than two numbers."""
    numbers = sum(map(is_number, cells))
    return (len(cells), numbers / sum(map(bool, cells))) if numbers >= 2 else None


def _parted(line: str, separator: str) -> list[str]:
    """Return the cells of a line; none of one that blanks do not part into numbers."""
    if separator != " ":
        return split_line(line, separator)
    cells = line.split()
    # A comma at the end of a number separates it from the next.
    plain = all(is_number(cell) and cell == cell.strip(",") for cell in cells)
    return cells if plain else []


def _heading_width(
    lines: list[str], separator: str, counts: np.ndarray, width: int
) -> int:
    """Return the cells of a line of headers, some of which may name remarks."""
    header = width
    for line, count in zip(lines, counts.tolist(), strict=True):
        cells = _cells_of(line, separator)
        # Names of gauges may be numbers too, but not most of them.
        share = _numbers(cells) if count == width else None
        if share is not None and share[1] > 0.5:
            return header if width < header <= width + _MOST_REMARKS else width
        if "".join(cells) and not is_number(cells[0]):
            header = count
    return width


def _tabbed(line: str, width: int) -> str:
    """Return a line with tabs for the blanks between its cells, if it has so many."""
    bare = _MARK.sub("", line, 1).strip() if _MARK.match(line) else line.strip()
    for cells in (bare.split(), _GAP.split(bare)):
        if len(cells) == width:
            return "\t".join(cells)
    return line
