"""Numbers with units, ranges and names, as they are written behind an option."""

import re
from collections.abc import Callable, Sequence
from typing import TypeVar

from hdcal.cli.options import read_grid
from hdcal.errors import Finding, InputError

T = TypeVar("T")
_QUANTITY = re.compile(r"\s*(?P<number>[-+0-9.eE]+)\s*(?P<unit>\S.*)?")
_KINDS = {"N": "a force", "mm": "a length", "MPa": "a stress", "N/mm": "a spring rate"}


def read_quantity(text: str, unit: str, option: str) -> float:
    """Read a number, alone in a code unit or with a unit behind it: 70, 0.07 kN.

    Args:
        text: as the user wrote it.
        unit: N, mm, MPa or N/mm.
        option: where it stands.

    Raises:
        InputError: it is no number, or its unit measures something else.
    """
    from hdcal.data.units import UnitError, to_code

    match = _QUANTITY.fullmatch(text)
    remedy = f"Write it like 70 {unit}"
    try:
        number = float(match["number"]) if match else None
    except ValueError:
        number = None
    if match is None or number is None:
        raise InputError([Finding(option, f"'{text[:60]}' is no number", remedy)])
    if match["unit"] is None:
        return number
    try:
        factor, code = to_code(match["unit"])
    except UnitError as error:
        raise InputError([Finding(option, str(error), remedy)]) from None
    if code != unit:
        words = f"'{text[:60]}' is not {_KINDS[unit]}: its unit is that of {code}"
        raise InputError([Finding(option, words, remedy)])
    return number * factor


def read_millimetres(text: str, option: str) -> float:
    """Read a length, in mm where no unit is written.

    Raises:
        InputError: it is none.
    """
    return read_quantity(text, "mm", option)


def read_ends(text: str, option: str) -> tuple[float, float]:
    """Read LO:HI.

    Raises:
        InputError: it is none.
    """
    parts = text.split(":")
    try:
        low, high = map(float, parts)
    except ValueError:
        words = f"'{text[:60]}' is not LO:HI"
        raise InputError([Finding(option, words, "Write it like 0.38:0.42")]) from None
    return low, high


def read_temperatures(text: str, option: str = "--temperature") -> list[float]:
    """Read one temperature, LO:HI or a list.

    Raises:
        InputError: it is none of them, or LO:HI is empty.
    """
    if text.count(":") != 1:
        return read_grid(text, option)
    low, high = read_ends(text, option)
    if not low <= high:
        words = f"'{text[:60]}' is empty"
        raise InputError([Finding(option, words, "Give the lower end first")])
    return [low, high]


def read_named(
    texts: Sequence[str], option: str, read: Callable[[str, str], T]
) -> dict[str, T]:
    """Read every NAME=…, whatever stands behind the sign.

    Args:
        texts: as the user wrote them.
        option: where they stand.
        read: reads what follows the name.

    Raises:
        InputError: holds what is wrong with any of them.
    """
    found: dict[str, T] = {}
    findings = []
    for text in texts:
        name, sign, rest = (part.strip() for part in text.partition("="))
        if not (name and sign and rest):
            words = f"'{text[:60]}' is not NAME=…"
            remedy = "Write it like wall_thickness_mm=0.6:0.76:5"
            findings.append(Finding(option, words, remedy))
            continue
        if name in found:
            words = f"'{name[:60]}' is given twice"
            findings.append(Finding(option, words, "Keep one of them"))
        try:
            found[name] = read(rest, option)
        except InputError as error:
            findings += error.findings
    if findings:
        raise InputError(findings)
    return found


def read_list(texts: Sequence[str]) -> list[str]:
    """Read names that are repeated or listed with commas."""
    return [name.strip() for text in texts for name in text.split(",") if name.strip()]


def names_in(texts: Sequence[str]) -> list[str]:
    """Return the names in NAME=…, also where what follows cannot be read."""
    names = [text.partition("=")[0].strip() for text in texts if "=" in text]
    return list(dict.fromkeys(filter(None, names)))
