"""Readings as JSON or CSV in, what the tracker makes of them as JSON lines out."""

import json
from collections.abc import Iterator
from itertools import chain
from typing import Any, BinaryIO, TextIO

from hdcal.tracking.csv_lines import csv_lines
from hdcal.tracking.tracker import SCHEMA, Tracker

# A longer line is no reading; the rest of it is thrown away unread.
_LONGEST = 1 << 16
_ENCODER = json.JSONEncoder(allow_nan=False)
_EXAMPLE = '{"deformation_mm": 0.1, "force_N": 19.8}'
_NUMBERS = {"deformation_mm": "deformation", "force_N": "force"}
_OPTIONAL = {"temperature_C": "temperature", "time_s": "time"}


def answer_lines(tracker: Tracker, source: BinaryIO, sink: TextIO) -> int:
    """Answer every line that is not blank, good or bad, before the next is read.

    A bad line is answered by what is wrong with it; nothing is learned from it, and
    the stream goes on. Rows count all lines that are answered.

    Args:
        tracker: that takes the readings.
        source: JSON objects with `deformation_mm` and `force_N`, and where known
            `temperature_C`, `time_s` and `run`; or a header row and lines of CSV.
        sink: takes a line for each.

    Returns:
        How many lines were no reading.
    """
    bad = 0
    lines = _lines(source)
    first = next(lines, None)
    table = None if first is None else csv_lines(first)
    if first is not None and table is None:
        lines = chain([first], lines)
    for line in lines:
        try:
            plain = read_line(line) if table is None else table.read(_text(line))
            found = tracker.update(**plain)
        except ValueError as error:
            bad += 1
            found = {"schema": SCHEMA, "status": "error", "row": tracker.skip()}
            found["error"] = str(error)
        sink.write(_ENCODER.encode(found) + "\n")
        sink.flush()
    return bad


def _text(line: bytes) -> str:
    """Return a line as text.

    Raises:
        ValueError: it is too long, or none.
    """
    if len(line) > _LONGEST:
        raise ValueError(f"the line is longer than {_LONGEST} bytes")
    try:
        return line.decode().strip("\r\n")
    except UnicodeDecodeError:
        raise ValueError("the line is no UTF-8 text") from None


def read_line(line: bytes) -> dict[str, Any]:
    """Return the arguments of `Tracker.update` from a line.

    Raises:
        ValueError: it is no JSON object with the numbers of a reading.
    """
    if len(line) > _LONGEST:
        raise ValueError(f"the line is longer than {_LONGEST} bytes")
    try:
        plain = json.loads(line)
    except (ValueError, RecursionError):
        words = (
            "the line is no JSON, nor of a table whose first row names deformation and "
            "force; one reading is one line such as"
        )
        raise ValueError(f"{words} {_EXAMPLE}") from None
    if not isinstance(plain, dict):
        raise ValueError(f"the line is no object such as {_EXAMPLE}")
    missing = [name for name in _NUMBERS if plain.get(name) is None]
    if missing:
        raise ValueError(f"{' and '.join(missing)} missing")
    found: dict[str, Any] = {}
    for name, argument in (_NUMBERS | _OPTIONAL).items():
        value = plain.get(name)
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{name} is no number")
        try:
            found[argument] = float(value)
        except OverflowError:
            raise ValueError(f"{name} is too large") from None
    run = plain.get("run")
    if run is not None:
        if not isinstance(run, str | int) or isinstance(run, bool):
            raise ValueError("run is no label")
        found["run"] = str(run)
    return found


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    while line := stream.readline(_LONGEST + 1):
        rest = line
        while len(rest) > _LONGEST and not rest.endswith(b"\n"):
            rest = stream.readline(_LONGEST + 1)
        if line.strip():
            yield line
