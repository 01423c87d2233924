"""Lines of JSON in, lines of JSON out, as fast as they come."""

import json
from collections.abc import Iterator
from typing import Any, BinaryIO, TextIO

from pydantic import ConfigDict, ValidationError

from hdcal.quantities import Quantities
from hdcal.tracking.tracker import StreamReading, Tracker

# A longer line is no reading; of the rest of it nothing is kept.
_LONGEST = 1 << 16
_ENCODER = json.JSONEncoder(allow_nan=False)


def answer_lines(tracker: Tracker, source: BinaryIO, sink: TextIO) -> int:
    """Answer every line that is not blank, as soon as it is there.

    Return the number of lines that were no reading.
    """
    bad, reading = 0, json_reading(tracker.units)
    for lines in _blocks(source):
        answers = tracker.follow([_attempt(reading, line) for line in lines])
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


def _attempt(reading: type[StreamReading], line: bytes) -> StreamReading | str:
    """Return the reading of a line, or why it is none."""
    if len(line) > _LONGEST:
        return f"the line is longer than {_LONGEST} bytes"
    try:
        return reading.model_validate_json(line)
    except ValidationError as error:
        if error.errors()[0]["type"] == "json_invalid":
            return "the line is not a JSON object"
        problems = [(*each["loc"], each["msg"]) for each in error.errors()]
        return "; ".join(": ".join(map(str, problem)) for problem in problems)


def json_reading(units: Quantities) -> type[StreamReading]:
    """Return the form of a line with keys such as `force_N`; others are ignored."""
    names = {"deformation": units.key("deformation_mm"), "force": units.key("force_N")}
    names |= {"temperature": "temperature_C"}

    class JsonReading(StreamReading):
        model_config = ConfigDict(
            extra="ignore", alias_generator=lambda name: names.get(name, name)
        )

    return JsonReading
