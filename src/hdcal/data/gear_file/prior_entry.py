"""One entry of a prior table: family, numbers and unit, into code units."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ValidationInfo, create_model

from hdcal.data.gear_file.toml_file import TomlFile, did_you_mean
from hdcal.data.gear_file.validation import STRICT, checked, fault
from hdcal.data.plausible import RANGES, out_of_range, range_of
from hdcal.data.prior import FAMILIES, Prior, scaled
from hdcal.data.units import UnitError, to_code
from hdcal.errors import Findings

# A modulus of 207 is meant in GPa, a thermal coefficient of 3 in 1e-4/K and a mass of
# 0.03 in kg, so these are never read without their unit.
_UNIT_NEEDED = {"E0": "GPa", "alpha": "1e-4/K", "mass": "kg"}


def _known_unit(text: str, info: ValidationInfo) -> str:
    """Return a unit if it converts to the one in the context of the validation."""
    wanted = info.context
    try:
        _, name = to_code(text)
    except UnitError as error:
        remedy = f'Write unit = "{wanted}"' if wanted else 'Write one such as "N/mm"'
        raise fault(str(error), remedy) from None
    if wanted is not None and name != wanted:
        words = f"'{text}' does not measure this"
        raise fault(words, f'Write a unit that converts to "{wanted}"')
    return text


def _positive(number: float) -> float:
    if number <= 0.0:
        raise fault(f"{number:g} is not positive", "Write its size")
    return number


def _above_low(number: float, info: ValidationInfo) -> float:
    if not info.data.get("low", -float("inf")) < number:
        raise fault("low is not below high", "Exchange them")
    return number


class _Entry(BaseModel):
    """Part of an entry of any family."""

    model_config = STRICT
    family: str
    unit: Annotated[str, AfterValidator(_known_unit)] | None = None
    source: Any = None
    note: Any = None


_SIZE = Annotated[float, AfterValidator(_positive)]
# Types of the numbers that are not any float.
_NUMBERS: dict[str, Any] = {
    **dict.fromkeys(("sd", "median", "log_sd", "a", "b"), _SIZE),
    "high": Annotated[float, AfterValidator(_above_low)],
}


def _entry_of(numbers: tuple[str, ...]) -> type[_Entry]:
    """Return the model of the entries of a family with these numbers."""
    fields: dict[str, Any] = {n: (_NUMBERS.get(n, float), ...) for n in numbers}
    return create_model("Entry", __base__=_Entry, **fields)


_ENTRIES = {family: _entry_of(numbers) for family, numbers in FAMILIES.items()}


def read_prior(
    entry: object, key: str, toml: TomlFile, unit: str | None = None
) -> Prior:
    """Read one entry such as `{ family = "normal", mean = 0.0, sd = 5.0 }`.

    Args:
        entry: as parsed.
        key: dotted key, for findings.
        toml: the file in which it stands.
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
    family, name = str(entry.get("family", "")), key.rpartition(".")[2]
    if family not in _ENTRIES:
        words = f"unknown choice '{family}'" if family else "is missing"
        raise toml.error(words, did_you_mean(family, [*FAMILIES]), f"{key}.family")
    table: Any = checked(_ENTRIES[family], entry, toml, key, unit)
    if table.unit is None and unit is not None and name in _UNIT_NEEDED:
        remedy = f'Write unit = "{_UNIT_NEEDED[name]}"'
        raise toml.error("is given without a unit", remedy, key)
    scale, known_unit = (1.0, unit or "") if table.unit is None else to_code(table.unit)
    if family == "beta" and scale != 1.0:
        words = "a beta prior lies between 0 and 1"
        raise toml.error(words, 'Write unit = "1"', f"{key}.unit")
    stated = [str(text) for text in (table.source, table.note) if text is not None]
    source = ". ".join(stated) or f"given in {Path(toml.file).name}"
    numbers = tuple(getattr(table, number) for number in FAMILIES[family])
    prior = Prior(family, numbers, known_unit, source)
    prior = prior if scale == 1.0 else scaled(prior, scale)
    quantity = "spring_stiffness" if name == "K" and unit == "N/mm" else name
    _check_numbers(prior, "effect" if unit is None else quantity, key, toml)
    return prior


def _check_numbers(prior: Prior, quantity: str, key: str, toml: TomlFile) -> None:
    """Refuse numbers in code units that no gear and no rig can have."""
    known = range_of(quantity)
    spread = known._replace(low=0.0, high=max(-known.low, known.high))
    ranges = {"log_sd": RANGES["log_sd"], "a": RANGES["beta"], "b": RANGES["beta"]}
    ranges |= {"sd": spread, "low": known._replace(low=min(known.low, 0.0))}
    with Findings() as wrong:
        for name, number in zip(FAMILIES[prior.family], prior.numbers, strict=True):
            for finding in out_of_range(name, float(number), ranges.get(name, known)):
                place = f"{key}.{name}"
                wrong.append(toml.finding(finding.problem, finding.remedy, place))
        if quantity == "noise_correlation" and not wrong:
            bounded = prior.family in ("beta", "uniform", "fixed")
            if not bounded or (prior.family, *prior.numbers) == ("fixed", 1.0):
                words = "a correlation lies from 0 to below 1"
                remedy = 'Write family = "beta", or "uniform" or "fixed" within that'
                name = "value" if bounded else "family"
                wrong.append(toml.finding(words, remedy, f"{key}.{name}"))
