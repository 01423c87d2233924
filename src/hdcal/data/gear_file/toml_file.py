"""Read TOML files, with findings on their keys, and write gear files."""

import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path

from hdcal.data.findings import FileFindings, why_not_readable
from hdcal.errors import Finding, InputError

_LARGEST = 1 << 20
_NAME = 200  # letters of a gear's name, as the schema takes them
_PLACE = re.compile(r"\s*\(at line (?P<row>\d+), column \d+\)")


@dataclass(frozen=True)
class TomlFile:
    """A parsed TOML file, and its name as the user gave it."""

    file: str
    table: dict

    def finding(self, problem: str, remedy: str, key: str) -> Finding:
        """Return a finding on a dotted key."""
        return Finding(self.file, problem, remedy, None, key)

    def error(self, problem: str, remedy: str, key: str) -> InputError:
        """Return an error of that one finding."""
        return InputError([self.finding(problem, remedy, key)])


def read_toml(source: Traversable | Path, file: str) -> TomlFile:
    """Read a TOML file; raise InputError where it is none."""
    findings = FileFindings(file)
    if isinstance(source, Path) and (why := why_not_readable(source, _LARGEST)):
        findings.refuse(*why)
    try:
        raw = source.read_bytes()
    except FileNotFoundError:
        findings.refuse("does not exist", "Check the name")
    except (OSError, ValueError) as error:
        words = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        findings.refuse(words, "Check name and permissions")
    try:
        table = tomllib.loads(raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        row = raw.count(b"\n", 0, error.start) + 1
        findings.refuse("is not UTF-8 text", "Save it as UTF-8", row)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        # RecursionError: thousands of nested brackets
        nested = isinstance(error, RecursionError)
        message = "nested too deeply" if nested else str(error)
        place = _PLACE.search(message)
        words = f"is not valid TOML: {_PLACE.sub('', message)[:200]}"
        row = int(place["row"]) if place else None
        findings.refuse(words, "Correct that line", row)
    return TomlFile(file, table)


def gear_text(tables: Mapping[str, Mapping[str, str | float]]) -> str:
    """Return the text of a gear file of these tables."""
    lines = []
    for table, rows in tables.items():
        lines += [f"[{table}]"] if rows else []
        for key, value in rows.items():
            if key == "name":
                # Of a file, whose name may hold anything.
                value = "".join(c for c in str(value) if c.isprintable())[:_NAME]
            # A text in TOML's quotes is written as in JSON.
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
        lines += [""] if rows else []
    return "\n".join(lines)
