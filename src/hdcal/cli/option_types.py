"""Values of options: numbers with units, ranges, lists, and names with values.

Each `read_…` takes the text of the user and the option's name, and raises an
`InputError` that says how to write the value.
"""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

import click

from hdcal.data.plausible import RANGES
from hdcal.errors import Finding, Findings, InputError
from hdcal.quantities import Quantities

T = TypeVar("T")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>[^\s\d.,].*)?")
_KINDS = {
    "N": ("a force", "70 N"),
    "mm": ("a length", "0.4 mm"),
    "MPa": ("a stress", "70 MPa"),
    "N/mm": ("a spring rate", "200 N/mm"),
}
_DECIMAL_COMMA = re.compile(r"\s*[-+]?0,\d+\s*")


class Parsed(click.ParamType):
    """An option read by a function; its findings are collected by the console."""

    def __init__(self, name: str, read: Callable[[str, str], Any]):
        self.name = name
        self._read = read

    def get_metavar(self, param, ctx=None) -> str:
        """Return the name as it is, without capitals."""
        return self.name

    def convert(self, value, param, ctx):
        """Return the value, or None if the text cannot be read."""
        if not isinstance(value, str) or param is None or ctx is None:
            return value
        return ctx.obj.wrong.attempt(self._read, value, param.opts[0])


def read_all(read: Callable[[Sequence[str], str], T]):
    """Return a callback that reads all texts of an option that may be repeated."""

    def callback(context: click.Context, option: click.Parameter, texts) -> T | None:
        return context.obj.wrong.attempt(read, texts, option.opts[0])

    return callback


def _refused(option: str, problem: str, remedy: str) -> InputError:
    return InputError([Finding(option, problem, remedy)])


class InUnit(float):
    """A number in N or mm that was given with its unit."""


def unit_findings(units: Quantities, **given: float | None) -> Iterator[Finding]:
    """Yield a finding for each option given in N or mm where torques were measured."""
    for name, value in given.items():
        if isinstance(value, InUnit) and not units.is_force:
            problem = "has the unit of a force or a length, but the data are "
            problem += f"{units.load}s over {units.displacement}s"
            unit = f"{units.displacement_unit} or {units.load_unit}"
            yield Finding(name, problem, f"Write the number without unit, in {unit}")


def read_quantity(text: str, option: str, *, unit: str) -> float:
    """Read a number in this unit, N, mm, MPa or N/mm, or with its own: 0.07 kN."""
    from hdcal.data.units import UnitError, to_code

    kind, example = _KINDS[unit]
    match = _QUANTITY.fullmatch(text)
    remedy = f"Write it like {example}, with a decimal point"
    if match is None:
        raise _refused(option, f"'{text}' is not a number", remedy)
    number = float(match["number"])
    if match["unit"] is None:
        return number
    try:
        factor, code = to_code(match["unit"])
    except UnitError as error:
        raise _refused(option, str(error), remedy) from None
    if code != unit:
        problem = f"'{text}' is not {kind}"
        if unit == "mm" and code == "1":
            remedy += "; write an angle in rad, without unit"
        raise _refused(option, problem, remedy)
    return InUnit(number * factor)


def read_ends(text: str, option: str) -> tuple[float, float]:
    """Read LO:HI."""
    try:
        low, high = map(float, text.split(":"))
        if math.isfinite(low) and math.isfinite(high):
            return low, high
    except ValueError:
        pass
    raise _refused(option, f"'{text}' is not LO:HI", "Write it like 0.38:0.42")


def read_grid(text: str, option: str) -> list[float]:
    """Read START:STOP:COUNT or a list of numbers with commas."""
    try:
        if ":" in text:
            first, last, many = text.split(":")
            numbers = _between(float(first), float(last), int(many))
        else:
            numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or not all(map(math.isfinite, numbers)):
        problem = f"'{text}' is neither start:stop:count nor a list of numbers"
        most = f"at most {RANGES['points'].high} numbers"
        remedy = f"Write it like 0:0.6:61 or 0.1,0.2 ({most})"
        raise _refused(option, problem, remedy)
    return numbers


def read_deformations(text: str, option: str) -> list[float]:
    """Read a grid; refuse 0,4, which may have a decimal comma or be a list."""
    if _DECIMAL_COMMA.fullmatch(text):
        first, second = text.strip().split(",")
        problem = f"'{text}' may be two numbers, or one with a decimal comma"
        remedy = f"Write {first}.{second} for one, {first}:{float(second):g}:2 for two"
        raise _refused(option, problem, remedy)
    return read_grid(text, option)


def _between(start: float, stop: float, count: int) -> list[float]:
    if not 1 <= count <= RANGES["points"].high:
        raise ValueError(count)
    # Weighted ends instead of NumPy's start + i·step: 0.35 stays 0.35.
    last = count - 1
    inner = [(start * (last - i) + stop * i) / last for i in range(1, last)]
    return [start, *inner, stop][:count]


def read_window(text: str, option: str, *, count: int = 2) -> list[float]:
    """Read a grid, or FROM:TO as that many numbers, both ends included."""
    if text.count(":") != 1:
        return read_grid(text, option)
    low, high = read_ends(text, option)
    if high < low:
        problem = f"'{text}' is an empty range"
        raise _refused(option, problem, "Give the lower end first")
    return _between(low, high, count if high > low else 1)


def read_named(
    texts: Sequence[str],
    option: str,
    *,
    read: Callable[[str, str], T],
    known: Callable[[], Sequence[str]] | None = None,
    fault: str = "is not NAME=…",
    example: str = "wall_thickness_mm=0.6:0.76:5",
) -> dict[str, T]:
    """Read NAME=VALUE texts, each value by `read`.

    `known` returns the allowed names; by default every name is. The fault is that of a
    text of another form than the example.
    """
    values: dict[str, T] = {}
    with Findings() as wrong:
        for text in texts:
            name, sign, rest = (part.strip() for part in text.partition("="))
            if not (name and sign and rest):
                remedy = f"Write it like {example}"
                wrong.append(Finding(option, f"'{text}' {fault}", remedy))
                continue
            if name in values:
                problem = f"'{name}' is given twice"
                wrong.append(Finding(option, problem, "Keep one of them"))
            if known is not None and name not in known():
                from hdcal.data.findings import did_you_mean

                remedy = did_you_mean(name, list(known()))
                wrong.append(Finding(option, f"unknown key '{name}'", remedy))
            value = wrong.attempt(read, rest, option)
            if value is not None:
                values[name] = value
    return values


ENDS = Parsed("LO:HI", read_ends)
DEFORMATIONS = Parsed("START:STOP:COUNT", read_deformations)
NUMBERS = Parsed("LIST", read_grid)
# Temperatures of which the worst counts: a window becomes eleven of them.
WINDOW = Parsed("FROM:TO", partial(read_window, count=11))
FORCE = Parsed("N", partial(read_quantity, unit="N"))
LENGTH = Parsed("MM", partial(read_quantity, unit="mm"))
STRESS = Parsed("MPA", partial(read_quantity, unit="MPa"))
