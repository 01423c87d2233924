"""One entry of a prior table: family, numbers and unit, into code units."""

import math
from collections.abc import Iterable
from pathlib import Path

from hdcal.data.prior import FAMILIES, Prior, scaled
from hdcal.data.prior_checks import (
    Fault,
    family_faults,
    quantity_of_K,
    range_faults,
    sign_faults,
)
from hdcal.data.toml_file import TomlFile, did_you_mean
from hdcal.data.units import UnitError, to_code
from hdcal.errors import Findings, InputError

# A modulus of 207 is meant in GPa, a thermal coefficient of 3 in 1e-4/K and a mass of
# 0.03 in kg, so these are never read without their unit.
_UNIT_NEEDED = {"E0": "GPa", "alpha": "1e-4/K", "mass": "kg"}
_WORDS = ("family", "unit", "source", "note")


def read_prior(
    entry: object, key: str, toml: TomlFile, unit: str | None = None
) -> Prior:
    """Read one entry such as `{ family = "normal", mean = 0.0, sd = 5.0 }`.

    Args:
        entry: as parsed.
        key: dotted key, for findings.
        toml: the file it stands in.
        unit: code unit of the parameter; None accepts any.

    Returns:
        The prior in code units.

    Raises:
        InputError: holds everything that is wrong with the entry.
    """
    if not isinstance(entry, dict):
        example = f'{{ family = "normal", mean = 0.0, sd = 1.0, unit = "{unit or 1}" }}'
        words = "is not a table with a family and its numbers"
        raise toml.error(words, f"Write {example}", key)
    family = entry.get("family")
    if not isinstance(family, str) or family not in FAMILIES:
        words = "names no family" if family is None else f"unknown family '{family}'"
        raise toml.error(
            words, did_you_mean(str(family), list(FAMILIES)), f"{key}.family"
        )
    with Findings() as wrong:
        numbers = wrong.attempt(_numbers, entry, family, key, toml)
        conversion = wrong.attempt(_conversion, entry, key, toml, unit)
    assert numbers is not None and conversion is not None
    scale, name = conversion
    # Without a unit of its own it is a parameter of an effect.
    parameter = "effect" if unit is None else key.rpartition(".")[2]
    if parameter == "K":
        parameter = quantity_of_K(unit)
    if unit is not None:
        _raise_faults(sign_faults(family, numbers, parameter), key, toml)
    if family == "beta" and scale != 1.0:
        words = "a beta prior lies between 0 and 1"
        raise toml.error(words, 'Write unit = "1"', f"{key}.unit")
    said = [str(entry[word]) for word in ("source", "note") if word in entry]
    source = ". ".join(said) or f"given in {Path(toml.file).name}"
    prior = Prior(family, tuple(numbers), name, source)
    prior = prior if scale == 1.0 else scaled(prior, scale)
    _raise_faults(
        range_faults(family, [*map(float, prior.numbers)], parameter), key, toml
    )
    return prior


def _numbers(entry: dict, family: str, key: str, toml: TomlFile) -> list[float]:
    """The family's numbers in their order, as written."""
    wanted = FAMILIES[family]
    findings = [
        toml.finding(
            f"is no part of a {family} prior",
            did_you_mean(str(extra), [*wanted, *_WORDS], "It takes"),
            f"{key}.{extra}",
        )
        for extra in entry
        if extra not in (*wanted, *_WORDS)
    ]
    numbers = [_finite(entry.get(size)) for size in wanted]
    faults = {fault.number: fault for fault in family_faults(family, numbers)}
    for size in wanted:
        if size not in entry:
            faults[size] = Fault(
                size, f"a {family} prior needs '{size}'", f"Write {size} = …"
            )
    for size in filter(faults.__contains__, wanted):
        _, words, remedy = faults[size]
        findings.append(toml.finding(words, remedy, f"{key}.{size}"))
    if findings:
        raise InputError(findings)
    return numbers


def _finite(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        number = float(value)
    except OverflowError:
        return math.nan
    return number if math.isfinite(number) else math.nan


def _conversion(
    entry: dict, key: str, toml: TomlFile, unit: str | None
) -> tuple[float, str]:
    """Factor to the code unit, and its name."""
    here = f"{key}.unit"
    given = entry.get("unit")
    if given is None:
        example = _UNIT_NEEDED.get(key.rpartition(".")[2])
        if example is None or unit is None:
            return 1.0, unit or ""
        raise toml.error("is given without a unit", f'Write unit = "{example}"', key)
    try:
        if not isinstance(given, str):
            raise UnitError("the unit is not a text")
        scale, name = to_code(given)
    except UnitError as error:
        remedy = f'Write unit = "{unit}"' if unit else 'Write one such as "N/mm"'
        raise toml.error(str(error), remedy, here) from None
    if unit is not None and name != unit:
        words = f"'{given}' does not measure this"
        raise toml.error(words, f'Write a unit that converts to "{unit}"', here)
    return scale, name


def _raise_faults(faults: Iterable[Fault], key: str, toml: TomlFile) -> None:
    with Findings() as wrong:
        wrong += [
            toml.finding(f.problem, f.remedy, f"{key}.{f.number}") for f in faults
        ]
