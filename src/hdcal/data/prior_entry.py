"""One entry of a prior table: family, numbers and unit, into code units."""

import math
from pathlib import Path

from hdcal.data.plausible import RANGES, out_of_range, range_of
from hdcal.data.prior import FAMILIES, Prior
from hdcal.data.toml_file import TomlFile, did_you_mean
from hdcal.data.units import UnitError, to_code
from hdcal.errors import Findings, InputError

# A modulus of 207 is meant in GPa, a thermal coefficient of 3 in 1e-4/K and a mass of
# 0.03 in kg, so these are never read without their unit.
_UNIT_NEEDED = {"E0": "GPa", "alpha": "1e-4/K", "mass": "kg"}
_SIGNED = (
    "alpha",
    "force_offset",
    "deformation_offset",
    "cte",
    "initial_deformation",
    "initial_velocity",
)
_SIZES = ("sd", "log_sd", "median", "a", "b")
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
    if unit is not None:
        _check_sign(family, numbers, key, toml)
    if family == "beta" and scale != 1.0:
        words = "a beta prior lies between 0 and 1"
        raise toml.error(words, 'Write unit = "1"', f"{key}.unit")
    said = [str(entry[word]) for word in ("source", "note") if word in entry]
    source = ". ".join(said) or f"given in {Path(toml.file).name}"
    # a logarithm's spread does not change with the unit
    scaled = tuple(
        number if size in ("log_sd", "a", "b") else number * scale
        for size, number in zip(FAMILIES[family], numbers, strict=True)
    )
    _check_plausible(family, scaled, key, toml, own=unit is not None)
    return Prior(family, scaled, name, source)


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
    for size, number in zip(wanted, numbers, strict=True):
        if size not in entry:
            words, remedy = f"a {family} prior needs '{size}'", f"Write {size} = …"
        elif math.isnan(number):
            words, remedy = "is not a finite number", "Write a plain number"
        elif size in _SIZES and number <= 0.0:
            words, remedy = f"{number:g} is not positive", "Write its size"
        else:
            continue
        findings.append(toml.finding(words, remedy, f"{key}.{size}"))
    if family == "uniform" and not findings and numbers[0] >= numbers[1]:
        words = "low is not below high"
        findings.append(toml.finding(words, "Exchange them", f"{key}.low"))
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


def _check_plausible(family: str, numbers, key: str, toml: TomlFile, own: bool):
    """Refuse numbers in code units that no gear and no rig can have.

    Args:
        family: of the prior.
        numbers: of the family.
        key: dotted key.
        toml: the file it stands in.
        own: whether the key names a quantity; else it is a parameter of an effect.

    Raises:
        InputError: holds a finding for each of them.
    """
    known = range_of(key.rpartition(".")[2] if own else "effect")
    widest = max(-known.low, known.high)
    spread = known._replace(low=0.0, high=widest)
    ranges = {"log_sd": RANGES["log_sd"], "a": RANGES["beta"], "b": RANGES["beta"]}
    ranges |= {"sd": spread, "low": known._replace(low=min(known.low, 0.0))}
    with Findings() as wrong:
        for size, number in zip(FAMILIES[family], numbers, strict=True):
            for found in out_of_range(size, number, ranges.get(size, known)):
                place = f"{key}.{size}"
                wrong.append(toml.finding(found.problem, found.remedy, place))


def _check_sign(family: str, numbers: list[float], key: str, toml: TomlFile) -> None:
    """A parameter that is positive by nature gets no prior centred below zero."""
    name = key.rpartition(".")[2]
    if family not in ("normal", "fixed", "uniform") or name in _SIGNED:
        return
    lowest = numbers[0]
    if lowest > 0.0 or (family == "uniform" and lowest == 0.0):
        return
    size = FAMILIES[family][0]
    words = f"{name} is positive, but {size} is {lowest:g}"
    raise toml.error(words, "Write a positive number", f"{key}.{size}")
