"""A TOML file with the line of each key."""

import re
import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path

from hdcal.data.regular_file import why_not_readable
from hdcal.errors import Finding, InputError

LARGEST = 1 << 20
# Lines without blanks around them.
_TABLE = re.compile(r"\[\[?(?P<name>[^\[\]]+)\]\]?\s*(#.*)?")
_KEY = re.compile(r"[\w\"'-]+")
_PLACE = re.compile(r"\s*\(at line (?P<row>\d+), column \d+\)")


@dataclass(frozen=True)
class TomlFile:
    """A parsed TOML file.

    Attributes:
        file: its name, as the user gave it.
        table: its content.
        text: as it stands in the file.
    """

    file: str
    table: dict
    text: str = ""

    def finding(self, problem: str, remedy: str, key: str) -> Finding:
        """Return a finding on a dotted key, with its line where that is known."""
        row = key
        while row and row not in self._rows:
            row = row.rpartition(".")[0]
        return Finding(self.file, problem, remedy, self._rows.get(row), key)

    def error(self, problem: str, remedy: str, key: str) -> InputError:
        """Return an error of that one finding."""
        return InputError([self.finding(problem, remedy, key)])

    @cached_property
    def _rows(self) -> dict[str, int]:
        """Line of each dotted key and table."""
        rows: dict[str, int] = {}
        table = ""
        for number, line in enumerate(map(str.strip, self.text.splitlines()), 1):
            name, sign, _ = line.partition("=")
            if header := _TABLE.fullmatch(line):
                here = table = _bare(header["name"])
            elif sign and all(_KEY.fullmatch(part.strip()) for part in name.split(".")):
                here = ".".join(filter(None, (table, _bare(name))))
            else:
                continue
            if here:
                rows.setdefault(here, number)
        return rows


def read_toml(source: Traversable | Path, file: str) -> TomlFile:
    """Read and parse a TOML file.

    Raises:
        InputError: missing, unreadable, too large, or not TOML.
    """

    def refusal(problem: str, remedy: str, row: int | None = None) -> InputError:
        return InputError([Finding(file, problem, remedy, row)])

    if isinstance(source, Path) and (why := why_not_readable(source, LARGEST)):
        raise refusal(*why)
    try:
        raw = source.read_bytes()
    except FileNotFoundError:
        raise refusal("does not exist", "Check the name") from None
    except (OSError, ValueError) as error:
        words = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise refusal(words, "Check name and permissions") from None
    try:
        table = tomllib.loads(text := raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        row = raw.count(b"\n", 0, error.start) + 1
        raise refusal("is not UTF-8 text", "Save it as UTF-8", row) from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        # RecursionError: thousands of nested brackets
        nested = isinstance(error, RecursionError)
        message = "nested too deeply" if nested else str(error)
        place = _PLACE.search(message)
        words = f"is not TOML: {_PLACE.sub('', message)[:200]}"
        row = int(place["row"]) if place else None
        raise refusal(words, "Correct that line", row) from None
    return TomlFile(file, table, text)


def did_you_mean(name: str, known: list[str], what: str = "Known are") -> str:
    """Return a remedy with the likeliest meaning of an unknown name, and all known."""
    by_lower = {item.lower(): item for item in known}
    near = get_close_matches(name.lower(), by_lower, 1, 0.5)
    hint = f"Did you mean '{by_lower[near[0]]}'? " if near else ""
    return f"{hint}{what}: {', '.join(known)}"


def _bare(name: str) -> str:
    return re.sub(r"[\"'\s]", "", name)
