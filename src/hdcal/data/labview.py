"""LabVIEW's measurement files: a column of comments that most lines leave out."""

from collections.abc import Iterator

from hdcal.data.table_start import split_line, unit_in

_BEGINS, _LAST, _UNITS = b"LabVIEW Measurement", "Comment", "Y_Unit_Label"


def with_whole_lines(utf8: bytes) -> bytes:
    """Return a file of LabVIEW's with as many cells in its readings as in its headers.

    Above its headers each block states the units of its channels, which join them.
    Any other text stays as it is.

    Args:
        utf8: lines ended by a newline.
    """
    if not utf8.startswith(_BEGINS):
        return utf8
    return "\n".join(_lines(utf8.decode().split("\n"))).encode()


def _lines(lines: list[str]) -> Iterator[str]:
    separator, width, units = "\t", 0, [""]
    for line in lines:
        bare = line.rstrip()
        if bare.startswith(_UNITS):
            units = split_line(bare, bare[len(_UNITS) :][:1] or separator)
        elif bare.endswith(_LAST) and bare[: -len(_LAST)][-1:] in (",", "\t"):
            separator = bare[: -len(_LAST)][-1]
            headers = split_line(bare, separator)
            width = len(headers)
            line = separator.join(_with_units(headers, units))
        elif not bare:
            width = 0
        elif width and len(split_line(line, separator)) == width - 1:
            line += separator
        yield line


def _with_units(headers: list[str], units: list[str]) -> list[str]:
    """Return headers with units, which are those of all but the first and the last."""
    if len(units) != len(headers) - 1:
        return headers
    known = ["", *map(unit_in, units[1:]), ""]
    return [
        f"{header} [{unit}]" if unit and unit not in header else header
        for header, unit in zip(headers, known, strict=True)
    ]
