"""Lines of JSON or CSV in, lines of JSON out, as fast as they come."""

import json
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO, TextIO

import numpy as np
from pydantic import ConfigDict, ValidationError

from hdcal.data.findings import FileFindings
from hdcal.data.tables.cells import CellError, read_number
from hdcal.data.tables.columns import choose_columns, in_place_of_force
from hdcal.data.tables.grid import split_line
from hdcal.data.tables.sources import table_of
from hdcal.data.tables.text import text_grid
from hdcal.errors import InputError
from hdcal.quantities import Quantities
from hdcal.tracking.tracker import StreamReading, Tracker

# A longer line is no reading; of the rest of it nothing is kept.
_LONGEST = 1 << 16
_ENCODER = json.JSONEncoder(allow_nan=False)
_REQUIRED, _OTHERS = ("deformation", "force"), ("temperature", "run")


def answer_lines(tracker: Tracker, source: BinaryIO, sink: TextIO) -> int:
    """Answer every line that is not blank, as soon as it is there.

    The source holds JSON objects, or a header row and lines of CSV. The number of lines
    that were no reading is returned.
    """
    bad, of_json, of_table, first = 0, json_reader(tracker.units), None, True
    for lines in _blocks(source):
        if first and lines:
            of_table, first = csv_reader(lines[0], tracker.units), False
            lines = lines[1:] if of_table else lines
        read = of_table or of_json
        answers = tracker.follow([_attempt(read, line) for line in lines])
        bad += sum(answer["status"] != "ok" for answer in answers)
        sink.writelines(_ENCODER.encode(answer) + "\n" for answer in answers)
        sink.flush()
    return bad


def _blocks(source: BinaryIO) -> Iterator[list[bytes]]:
    """Yield the lines that have come so far, without the blank ones."""
    buffered: Any = source
    rest = b""
    while chunk := buffered.read1(_LONGEST):
        *lines, rest = (rest + chunk).split(b"\n")
        rest = rest[: _LONGEST + 1]
        yield [line for line in lines if line.strip()]
    yield [rest] if rest.strip() else []


def _attempt(
    read: Callable[[bytes], StreamReading], line: bytes
) -> StreamReading | str:
    """Return the reading of a line, or why it is none."""
    if len(line) > _LONGEST:
        return f"the line is longer than {_LONGEST} bytes"
    try:
        return read(line)
    except ValidationError as error:
        problems = [(*each["loc"], each["msg"]) for each in error.errors()]
        return "; ".join(": ".join(map(str, problem)) for problem in problems)
    except ValueError as error:
        return str(error)


def json_reader(units: Quantities) -> Callable[[bytes], StreamReading]:
    """Return the reader of lines of JSON with keys such as `force_N`."""
    names = {"deformation": units.key("deformation_mm"), "force": units.key("force_N")}
    names |= {"temperature": "temperature_C"}

    class JsonReading(StreamReading):
        model_config = ConfigDict(
            extra="ignore", alias_generator=lambda name: names.get(name, name)
        )

    return JsonReading.model_validate_json


def csv_reader(
    header: bytes, units: Quantities
) -> Callable[[bytes], StreamReading] | None:
    """Return the reader of the lines below a header row; None if it is none."""
    names = *_REQUIRED, *_OTHERS, *(() if units.is_force else ("angle", "torque"))
    try:
        grid, _ = text_grid(header.decode("utf-8-sig").strip())
        with FileFindings("standard input") as wrong:
            used = choose_columns(table_of(grid, wrong), {}, names, _REQUIRED, wrong)
    except (UnicodeDecodeError, InputError):
        return None
    if ("torque" in used) == units.is_force:
        return None
    columns, separator, comma = in_place_of_force(used), grid.separator, False

    def read(line: bytes) -> StreamReading:
        nonlocal comma
        cells = split_line(line.decode().strip("\r\n"), separator)
        if len(cells) != grid.width:
            raise ValueError(f"{len(cells)} cells where the header has {grid.width}")
        found: dict[str, Any] = {n: cells[c.position] for n, c in columns.items()}
        for quantity, column in columns.items():
            if column.unit is None:
                continue
            # A decimal sign holds for the whole stream once a comma was one.
            comma |= separator != "," and "," in found[quantity]
            try:
                number = np.array([read_number(found[quantity], comma)])
            except CellError as error:
                raise ValueError(f"{quantity}: {error.args[0]}") from None
            found[quantity] = float(column.unit.convert(number)[0])
        return StreamReading(**found)

    return read
