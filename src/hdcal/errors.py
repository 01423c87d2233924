"""Errors for users: each states what is wrong and what to do."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import ParamSpec, Self, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
# Text of a file may be of any length: most characters of a quoted name or cell, of a
# file name, and of a sentence, in a finding.
_LONGEST_NAME, _LONGEST_FILE, _LONGEST_SENTENCE = 120, 255, 1000
_QUOTED = re.compile(rf"(?<!\w)'[^']{{{_LONGEST_NAME + 1},}}'(?!\w)")


@dataclass(frozen=True)
class Finding:
    """A problem of an input, and its remedy.

    Parameters of the library are in backticks; commands replace them by their options.
    Long names and cells are shortened, control characters escaped.

    Attributes:
        file: the input as the user named it, or a parameter.
        problem: one sentence without a full stop.
        remedy: one sentence without a full stop.
        row: line of the file, 1 = header line; None if it concerns the file.
        column: header or dotted key; None if it concerns the row or file.
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
        """File, row and column, as far as they are known."""
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
    """Return a sentence with a full stop, unless it ends in ? or !."""
    return text if text.endswith(("?", "!")) else f"{text}."


def quoted(name: str) -> str:
    """Return a name from a file in quotes, shortened and printable."""
    return f"'{_shown(name, _LONGEST_NAME)}'"


def shortened(items: Sequence[object], most: int) -> str:
    """Return the first items and the number of the others: 'a, b and 3 more'."""
    more = len(items) - most
    first = ", ".join(str(item) for item in items[:most])
    return f"{first} and {more} more" if more > 0 else first


def _shown(text: str, longest: int) -> str:
    """Return a text on one line, shortened in its middle."""
    if len(text) > longest:
        half = longest // 2
        text = f"{text[:half]}…{text[-half:]}"
    return printable(text)


def printable(text: str) -> str:
    """Return a text in which characters that control a terminal are escaped."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )


class HdcalError(Exception):
    """Base class of the errors of hdcal."""


class InputError(HdcalError):
    """The input cannot be used; holds all findings."""

    def __init__(self, findings: Iterable[Finding]):
        self.findings = tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self.findings))


class NotWritable(HdcalError):
    """A result could not be written."""


class NotUsable(HdcalError):
    """A result failed its checks: nothing may be derived from it."""


class Findings(list[Finding]):
    """Findings of several steps, reported together.

    At its end the context raises an `InputError` of all findings:

        with Findings() as wrong:
            case = wrong.attempt(read_case, path)
            wrong.attempt(choose_effects, names)
    """

    def attempt(
        self, make: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs
    ) -> T | None:
        """Return the result of a call, or None and collect its findings."""
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
            # Many cases may share one gear file; its findings are reported once.
            raise InputError(dict.fromkeys(self)) from None
