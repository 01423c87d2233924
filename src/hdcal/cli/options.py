"""Options that several commands share, and how their texts are read."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, get_args

import click

from hdcal.cli.console import Console
from hdcal.data.theory_names import Theory
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from hdcal.data.case import Case

MOST_POINTS = 100_000


T = TypeVar("T")


class Parsed(click.ParamType):
    """An option's text, read by hdcal; what cannot be read is said with all else.

    Args:
        name: shown in the help.
        read: called with the text and the option's name; raises `InputError`.
    """

    def __init__(self, name: str, read: Callable[[str, str], Any]):
        self.name = name
        self._read = read

    def convert(self, value, param, ctx):
        """Return what was read, or None where the text cannot be."""
        if not isinstance(value, str) or param is None or ctx is None:
            return value
        return ctx.obj.wrong.attempt(self._read, value, param.opts[0])


def read_all(read: Callable[[Sequence[str], str], T]):
    """Return a callback that reads all texts of an option that may be repeated.

    Args:
        read: called with the texts and the option's name; raises `InputError`.
    """

    def callback(context: click.Context, option: click.Parameter, texts) -> T | None:
        return context.obj.wrong.attempt(read, texts, option.opts[0])

    return callback


def read_columns(texts: Sequence[str], option: str = "--column") -> dict[str, str]:
    """Read every QUANTITY=HEADER.

    Raises:
        InputError: one of them has no such form, or a quantity comes twice.
    """
    found: dict[str, str] = {}
    findings = []
    for text in texts:
        quantity, sign, header = (part.strip() for part in text.partition("="))
        if not (quantity and sign and header):
            remedy = "Write it like force=Load[kgf]"
            findings.append(Finding(option, f"'{text}' names no header", remedy))
        elif quantity in found:
            words = f"'{quantity}' is given twice"
            findings.append(Finding(option, words, "Keep one of them"))
        found[quantity] = header
    if findings:
        raise InputError(findings)
    return found


def case_options(command: Callable) -> Callable:
    """Add the argument and options that say which case to read."""
    return reading_options(click.argument("data", metavar="DATA")(command))


def reading_options(command: Callable) -> Callable:
    """Add the options that say how cases are read."""
    for add in (
        click.option(
            "--theory",
            type=click.Choice(get_args(Theory)),
            help="Stiffness formula that K multiplies; overrides the gear file.",
        ),
        click.option(
            "--column",
            "columns",
            metavar="QUANTITY=HEADER",
            multiple=True,
            callback=read_all(read_columns),
            help="Read a quantity from a header of your own: force=Load[kgf].",
        ),
        click.option(
            "--gear",
            metavar="GEAR.toml",
            help="The gear file [default: gear.toml beside the data].",
        ),
    ):
        command = add(command)
    return command


def read_given(console: Console, data, gear, columns, theory) -> "Case | None":
    """Read the case that `case_options` named; what is wrong is kept by the console."""
    from hdcal.data.reading import read_case

    if columns is None:  # it could not be read, which is said already
        return None
    read = partial(read_case, columns=columns, theory=theory)
    return console.wrong.attempt(read, data, gear)


def json_option(command: Callable) -> Callable:
    """Add --json; the console knows it already, click has to accept it."""
    words = "Print one JSON object; words go to standard error."
    option = click.option(
        "--json", "_json", is_flag=True, expose_value=False, help=words
    )
    return option(command)


def out_option(command: Callable) -> Callable:
    """Add --out and --force, for a command that writes a folder where it is asked."""
    words = "Also write a folder with a report."
    return click.option("--out", metavar="DIR", help=words)(force_option(command))


def force_option(command: Callable) -> Callable:
    """Add --force."""
    words = "Replace an older result of hdcal."
    return click.option("--force", is_flag=True, help=words)(command)


def direction_option(command: Callable) -> Callable:
    """Add --direction."""
    return click.option(
        "--direction",
        type=click.Choice(["up", "down"]),
        default="up",
        show_default=True,
        help="Loading or unloading.",
    )(command)


def seed_option(command: Callable) -> Callable:
    """Add --seed."""
    return click.option(
        "--seed",
        type=click.IntRange(0, 2**32 - 1),
        default=0,
        show_default=True,
        help="The same seed gives the same result.",
    )(command)


def read_whole_numbers(text: str, option: str) -> list[int]:
    """Read a list of whole numbers.

    Raises:
        InputError: it is none.
    """
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        words = f"'{text[:60]}' is no list of whole numbers"
        raise InputError([Finding(option, words, "Write it like 1,3")]) from None


def read_grid(text: str, option: str) -> list[float]:
    """Read start:stop:count or a comma list of numbers.

    Raises:
        InputError: it is neither, or too long.
    """
    try:
        numbers = _range(text) if ":" in text else [float(x) for x in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or not all(map(math.isfinite, numbers)):
        words = f"'{text[:60]}' is neither start:stop:count nor a list of numbers"
        remedy = f"Write it like 0:0.6:61 or 0.1,0.2, with at most {MOST_POINTS} points"
        raise InputError([Finding(option, words, remedy)])
    return numbers


def _range(text: str) -> list[float]:
    first, last, many = text.split(":")
    start, stop, count = float(first), float(last), int(many)
    if not 1 <= count <= MOST_POINTS:
        raise ValueError(many)
    if count == 1:
        return [start]
    # The ends are met exactly, which start + i·step would not promise.
    return [
        (start * (count - 1 - i) + stop * i) / (count - 1)
        if 0 < i < count - 1
        else (start if i == 0 else stop)
        for i in range(count)
    ]


# Temperatures over which a window is spread.
_WINDOW = 11


def read_window(text: str, option: str = "--temperature") -> list[float]:
    """Read from:to, from:to:count or a comma list of numbers.

    Raises:
        InputError: it is none of them, or an empty window.
    """
    if text.count(":") != 1:
        return read_grid(text, option)
    first, last = text.split(":")
    ends = read_grid(f"{first or 'x'},{last or 'x'}", option)
    if ends[1] < ends[0]:
        words = f"'{text[:60]}' is an empty window"
        raise InputError([Finding(option, words, "Give the lower end first")])
    return read_grid(
        f"{ends[0]}:{ends[1]}:{_WINDOW if ends[1] > ends[0] else 1}", option
    )
