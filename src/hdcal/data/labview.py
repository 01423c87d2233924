"""LabVIEW's measurement files: a column of comments that most lines leave out."""

import re
from collections.abc import Iterator

from hdcal.data.findings import FileFindings
from hdcal.data.table_start import is_number, split_line, unit_in
from hdcal.data.unit_row import other_units, with_unit

_BEGINS, _LAST, _UNITS = b"LabVIEW Measurement", "Comment", "Y_Unit_Label"
# What the first column holds, and how it is then called: seconds, if it is filled.
_FIRST, _TIME, _TIMED = "X_Dimension", "Time", "X_Value (Time) [s]"
_NO_FIRST = re.compile(r"X_Columns\W+No\b")
_SEPARATORS = "\t,;"
# Lines at the top in which the file says how it was written.
_PREAMBLE = 30


def with_whole_lines(utf8: bytes, findings: FileFindings) -> bytes:
    """Return a file of LabVIEW's with as many cells in its readings as in its headers.

    Above its headers each block states the units of its channels, which join them, and
    whether it begins with the time. Any other text stays as it is.

    Args:
        utf8: lines ended by a newline.
        findings: of the file; gets one where headers name other units.
    """
    if not utf8.startswith(_BEGINS):
        return utf8
    return "\n".join(_lines(utf8.decode().split("\n"), findings)).encode()


def _lines(lines: list[str], findings: FileFindings) -> Iterator[str]:
    separator, width, units, row_of_units = "\t", 0, [], 0
    timed, filled = False, not any(map(_NO_FIRST.match, lines[:_PREAMBLE]))
    for row, line in enumerate(lines, 1):
        bare = line.rstrip()
        headers = _headers(bare)
        if bare.startswith(_UNITS):
            mark = bare[len(_UNITS) :][:1] or separator
            units, row_of_units = split_line(line, mark)[1:], row
        elif bare.startswith(_FIRST):
            timed = _TIME in bare
        elif headers:
            separator, width = bare[: -len(_LAST)][-1], len(headers)
            own = [*headers, *[""] * (len(split_line(line, separator)) - width)]
            labels = ["", *map(unit_in, units)] if _of_channels(headers) else []
            findings.add_rows(other_units(headers, labels, row_of_units))
            if timed and filled and _of_channels(headers):
                own[0] = _TIMED
            labels += [""] * (len(own) - len(labels))
            line = separator.join(map(with_unit, own, labels))
            units = []
        elif not bare:
            width = 0
        elif width and len(split_line(line, separator)) == width - 1:
            line += separator
        yield line


def _headers(bare: str) -> list[str]:
    """Return the cells of a line of headers; none of any other line."""
    separator = bare[: -len(_LAST)][-1:] if bare.endswith(_LAST) else ""
    if not separator or separator not in _SEPARATORS:
        return []
    cells = split_line(bare, separator)
    return [] if any(map(is_number, cells)) else cells


def _of_channels(headers: list[str]) -> bool:
    """Tell whether all between the first and the last are channels."""
    return headers.count("X_Value") == 1 and headers[0] == "X_Value"
