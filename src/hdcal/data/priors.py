"""Prior tables: a family, its numbers, a unit and a source for every parameter."""

from collections.abc import Mapping
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from hdcal.data.full_scale import REFERENCE, FullScale
from hdcal.data.gear_file.prior_entry import read_prior
from hdcal.data.gear_file.toml_file import TomlFile, did_you_mean, read_toml
from hdcal.data.prior import Prior as Prior
from hdcal.data.resources import priors_folder
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


def read_entries(
    table: Mapping[str, Any],
    units: Mapping[str, str],
    toml: TomlFile,
    prefix: str = "",
    *,
    effects: bool = False,
) -> dict[str, Prior]:
    """Return the priors in a table.

    Args:
        table: as parsed.
        units: code unit of every parameter that it may hold.
        toml: the file in which it stands.
        prefix: dotted key of the table, empty at the top.
        effects: whether it may hold parameters of effects, unchecked, too: a table for
            each effect, or `effect.parameter`.

    Raises:
        InputError: holds everything that is wrong with the table.
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
                remedy += "; or a table for each effect" if effects else ""
                wrong.append(toml.finding(words, remedy, key))
                continue
            for parameter, (one, place) in entries.items():
                unit = units.get(parameter)
                if prior := wrong.attempt(read_prior, one, place, toml, unit):
                    priors[parameter] = prior
    return priors


def read_priors(
    source: Traversable | Path, units: Mapping[str, str], file: str = ""
) -> dict[str, Prior]:
    """Read a prior file whose top-level tables are parameters.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
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
    """Return priors and facts of a shipped material, keyed as `MATERIAL_UNITS`.

    Raises:
        InputError: no such material.
    """
    if name not in material_names():
        remedy = did_you_mean(name, material_names())
        raise InputError([Finding(f"{name}.toml", "unknown material", remedy)])
    return _shipped(name).copy()


def read_material(source: Path, file: str) -> dict[str, Prior]:
    """Read the file of a material, keyed as `MATERIAL_UNITS`.

    Raises:
        InputError: holds everything that is wrong with it, also what it lacks.
    """
    facts = read_priors(source, MATERIAL_UNITS, file)
    lacking = [need for need in ("E0", "alpha", "poisson") if need not in facts]
    if lacking:
        words = "the material says nothing of " + " and ".join(lacking)
        remedy = 'Write a table for each, such as [poisson] family = "fixed"'
        raise InputError([Finding(file, words, remedy)])
    ratio = facts["poisson"]
    if ratio.family != "fixed" or not ratio.numbers[0] < 0.5:
        words, remedy = "is not a number below 0.5", 'Write family = "fixed"'
        raise InputError([Finding(file, words, remedy, None, "poisson")])
    return facts
