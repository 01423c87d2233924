"""The errors a user can meet: every one carries words, none needs a traceback."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import ParamSpec, Self, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
# What stands in a file may be of any length: most letters of a name or cell that is
# quoted, of a file's name, and of a sentence, that a finding repeats.
_LONGEST_NAME, _LONGEST_FILE, _LONGEST_SENTENCE = 120, 255, 1000
_QUOTED = re.compile(rf"(?<!\w)'[^']{{{_LONGEST_NAME + 1},}}'(?!\w)")


@dataclass(frozen=True)
class Finding:
    """One thing wrong with an input, and what to do about it.

    A parameter of the library is written in backticks within the words; a command
    says its own option in its place. Long names and cells are cut in their middle,
    and characters that steer a terminal are escaped.

    Attributes:
        file: the input the finding is about, as the user named it, or a parameter.
        problem: what is wrong, one sentence without a full stop.
        remedy: what to do, one sentence without a full stop.
        row: line of the file, 1 = header line; None when it concerns the file.
        column: header or dotted key; None when it concerns the row or file.
    """

    file: str
    problem: str
    remedy: str
    row: int | None = None
    column: str | None = None

    def __post_init__(self) -> None:
        for name in ("problem", "remedy"):
            text = _QUOTED.sub(lambda long: quoted(long[0][1:-1]), getattr(self, name))
            object.__setattr__(self, name, _shown(text, _LONGEST_SENTENCE))
        if self.column is not None:
            object.__setattr__(self, "column", _shown(self.column, _LONGEST_NAME))

    @property
    def where(self) -> str:
        """Return file, row and column, as far as they are known."""
        where = _shown(self.file, _LONGEST_FILE)
        if self.row is not None:
            where += f", row {self.row}"
        if self.column is not None:
            where += f", column '{self.column}'"
        return where

    def __str__(self) -> str:
        remedy = self.remedy[:1].upper() + self.remedy[1:]
        problem, remedy = (ended(text) for text in (self.problem, remedy))
        return f"{self.where}: {problem} {remedy}"


def ended(text: str) -> str:
    """Return a sentence with its full stop; a question has its own mark."""
    return text if text.endswith(("?", "!")) else f"{text}."


def quoted(name: str) -> str:
    """Return a name from a file in quotes, as findings show it."""
    return f"'{_shown(name, _LONGEST_NAME)}'"


def shortened(items: Sequence[object], most: int) -> str:
    """Return the first items, and how many more there are: 'a, b and 3 more'."""
    more = len(items) - most
    first = ", ".join(str(item) for item in items[:most])
    return f"{first} and {more} more" if more > 0 else first


def _shown(text: str, longest: int) -> str:
    """Return a text on one line, cut in its middle where it is longer."""
    if len(text) > longest:
        half = longest // 2
        text = f"{text[:half]}…{text[-half:]}"
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )


class HdcalError(Exception):
    """Base of every error that hdcal raises on purpose."""


class InputError(HdcalError):
    """The input cannot be used; holds every finding, not only the first."""

    def __init__(self, findings: Iterable[Finding]):
        self.findings = tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self.findings))


class NotWritable(HdcalError):
    """A result could not be written; the text states what is there."""


class NotUsable(HdcalError):
    """A result exists but failed its checks, so nothing may be derived from it."""


class Findings(list[Finding]):
    """Findings of several steps, reported together.

    As a context it raises an `InputError` of everything that was found inside it:

        with Findings() as wrong:
            case = wrong.attempt(read_case, path)
            wrong.attempt(choose_effects, names)
    """

    def attempt(
        self, make: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs
    ) -> T | None:
        """Return what is made, or None and keep why it cannot be."""
        try:
            return make(*args, **kwargs)
        except InputError as error:
            self += error.findings
            return None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind, error, trace) -> None:
        if isinstance(error, InputError):
            self += error.findings
        elif error is not None:
            return
        if self:
            # One gear file may be behind many cases; its faults are reported once.
            raise InputError(dict.fromkeys(self)) from None
