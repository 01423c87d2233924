"""Prior tables: a family, its numbers, a unit and a source for every parameter."""

from collections.abc import Mapping
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ValidationInfo, create_model

from hdcal.data.findings import did_you_mean
from hdcal.data.gear_file.toml_file import TomlFile, read_toml
from hdcal.data.gear_file.validation import STRICT, checked, fault
from hdcal.data.plausible import RANGES, out_of_range, range_of
from hdcal.data.prior import FAMILIES, REFERENCE, FullScale, scaled
from hdcal.data.prior import Prior as Prior
from hdcal.data.resources import priors_folder
from hdcal.data.units import UnitError, to_code
from hdcal.errors import Finding, Findings, InputError

_NO_MATERIALS = ("rig", "effects", "dynamics")
# Facts of the geometry, whatever the scale of the readings.
_FACTS = ("large_deflection.curvature",)

# What a prior table may hold: name -> its unit inside hdcal.
MODEL_UNITS = {
    "K": "1",
    "E0": "MPa",
    "alpha": "1/K",
    "force_offset": "N",
    "deformation_offset": "mm",
    "sigma": "N",
}
# Units of K, E0 and alpha under the theory `spring`.
SPRING_UNITS = {
    "spring_stiffness": "N/mm",
    "spring_modulus": "MPa",
    "spring_alpha": "1/K",
}
SCALE_UNITS = {
    "run_offset_sd": "N",
    "specimen_sd": "1",
    "gap_sd": "N",
    "gap_length": "1",
    "noise_correlation": "1",
}
# A gear file may state these; `mass` takes the place of the shipped mass_ratio.
DYNAMIC_UNITS = {
    "mass": "N*s^2/mm",
    "damping_ratio": "1",
    "initial_deformation": "mm",
    "initial_velocity": "mm/s",
    "deformation_sigma": "mm",
}
MATERIAL_UNITS = {
    "E0": "MPa",
    "alpha": "1/K",
    "poisson": "1",
    "density": "N*s^2/mm^4",
    "cte": "1/K",
    "yield_strength": "MPa",
}
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
        words = f"'{text}' is not a unit of this parameter"
        raise fault(words, f'Write a unit that converts to "{wanted}"')
    return text


def _positive(number: float) -> float:
    if number <= 0.0:
        raise fault(f"{number:g} is not positive", "Write a positive number")
    return number


def _above_low(number: float, info: ValidationInfo) -> float:
    if not info.data.get("low", -float("inf")) < number:
        raise fault("low is not less than high", "Exchange low and high")
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
    fields: dict[str, Any] = {n: (_NUMBERS.get(n, float), ...) for n in numbers}
    return create_model("Entry", __base__=_Entry, **fields)


_ENTRIES = {family: _entry_of(numbers) for family, numbers in FAMILIES.items()}


def read_prior(
    entry: object, key: str, toml: TomlFile, unit: str | None = None
) -> Prior:
    """Read the entry at a dotted key, as `{ family = "normal", mean = 0.0, sd = 5.0 }`.

    The code unit None accepts any.
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
        words = "a beta prior has no unit, as it lies between 0 and 1"
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
                words = "a correlation must be from 0 to below 1"
                remedy = 'Write family = "beta", or "uniform" or "fixed" in this range'
                name = "value" if bounded else "family"
                wrong.append(toml.finding(words, remedy, f"{key}.{name}"))


def read_entries(
    table: Mapping[str, Any],
    units: Mapping[str, str],
    toml: TomlFile,
    prefix: str = "",
    *,
    effects: bool = False,
) -> dict[str, Prior]:
    """Return the priors in a table at the dotted key `prefix`, or raise InputError.

    Units are those of every parameter that it may hold. With `effects` it may hold
    parameters of effects, unchecked: a table for each effect, or `effect.parameter`.
    """
    priors: dict[str, Prior] = {}
    with Findings() as wrong:
        for name, entry in table.items():
            key = f"{prefix}.{name}" if prefix else name
            several = isinstance(entry, dict) and "family" not in entry
            if name in units or (effects and "." in name):
                entries = {name: (entry, key)}
            elif effects and several:
                entries = {f"{name}.{n}": (e, f"{key}.{n}") for n, e in entry.items()}
            else:
                words, remedy = "unknown key", did_you_mean(name, list(units))
                remedy += "; or one table for each effect" if effects else ""
                wrong.append(toml.finding(words, remedy, key))
                continue
            for parameter, (stated, place) in entries.items():
                unit = units.get(parameter)
                if prior := wrong.attempt(read_prior, stated, place, toml, unit):
                    priors[parameter] = prior
    return priors


def read_priors(
    source: Traversable | Path, units: Mapping[str, str], file: str = ""
) -> dict[str, Prior]:
    """Read a prior file, in which the top-level tables are parameters."""
    toml = read_toml(source, file or source.name)
    words = ("name", "description")
    table = {name: entry for name, entry in toml.table.items() if name not in words}
    return read_entries(table, units, toml)


@cache
def _shipped(name: str) -> dict[str, Prior]:
    moving = DYNAMIC_UNITS | {"mass_ratio": "1"}
    units = {"rig": MODEL_UNITS | SCALE_UNITS | SPRING_UNITS, "dynamics": moving}
    source = priors_folder() / f"{name}.toml"
    if name == "effects":
        toml = read_toml(source, source.name)
        return read_entries(toml.table, {}, toml, effects=True)
    return read_priors(source, units.get(name, MATERIAL_UNITS))


def rig_priors() -> dict[str, Prior]:
    """Return shipped priors by the names in MODEL_, SCALE_ and SPRING_UNITS."""
    return _shipped("rig").copy()


def dynamic_priors() -> dict[str, Prior]:
    """Return shipped priors: `DYNAMIC_UNITS`, the mass as `mass_ratio`."""
    return _shipped("dynamics").copy()


def effect_priors(full_scale: FullScale = REFERENCE) -> dict[str, Prior]:
    """Return shipped priors of the effects' parameters, keyed `effect.parameter`."""
    return {
        name: prior if name in _FACTS else full_scale.own(prior)
        for name, prior in _shipped("effects").items()
    }


def material_names() -> list[str]:
    """Return the materials that hdcal ships, in alphabetical order."""
    files = (item.name for item in priors_folder().iterdir())
    stems = (name.removesuffix(".toml") for name in files if name.endswith(".toml"))
    return sorted(stem for stem in stems if stem not in _NO_MATERIALS)


def material_priors(name: str) -> dict[str, Prior]:
    """Return priors and facts of a shipped material, keyed as `MATERIAL_UNITS`."""
    if name not in material_names():
        remedy = did_you_mean(name, material_names())
        raise InputError([Finding(f"{name}.toml", "unknown material", remedy)])
    return _shipped(name).copy()


def read_material(source: Path, file: str) -> dict[str, Prior]:
    """Read the file of a material, keyed as `MATERIAL_UNITS`."""
    facts = read_priors(source, MATERIAL_UNITS, file)
    lacking = [need for need in ("E0", "alpha", "poisson") if need not in facts]
    if lacking:
        words = "the material file lacks " + " and ".join(lacking)
        remedy = 'Add a table for each, such as [poisson] family = "fixed"'
        raise InputError([Finding(file, words, remedy)])
    ratio = facts["poisson"]
    if ratio.family != "fixed" or not ratio.numbers[0] < 0.5:
        words, remedy = "is not a number below 0.5", 'Write family = "fixed"'
        raise InputError([Finding(file, words, remedy, None, "poisson")])
    return facts
