"""Read the gear file: sizes, how it was measured, and its priors."""

import math
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hdcal.data.case import Gear
from hdcal.data.gear_file.certificates import (
    GAUGE_UNITS,
    certificate_priors,
    contact_as_read,
)
from hdcal.data.gear_file.rig_facts import rig_fact_priors
from hdcal.data.gear_file.schema import GearFile, size_findings, tables_of
from hdcal.data.gear_file.toml_file import TomlFile, read_toml
from hdcal.data.gear_file.validation import checked
from hdcal.data.prior import FullScale, Prior
from hdcal.data.priors import (
    DYNAMIC_UNITS,
    MODEL_UNITS,
    SCALE_UNITS,
    SPRING_UNITS,
    dynamic_priors,
    material_names,
    material_priors,
    read_entries,
    read_material,
    rig_priors,
)
from hdcal.data.records import Geometry
from hdcal.data.theory_names import SPRING
from hdcal.errors import Findings

# Shipped priors of the base model that are written for a full scale.
_IN_NEWTONS = ("sigma", "run_offset_sd", "gap_sd")
# The material of a spring that names none, and of any other gear that names none.
NO_MATERIAL, _MATERIAL = "not stated", "steel"
_IN_MEMORY = "gear"  # name in findings of a gear that no file describes


def read_gear(source: Path | str | Mapping[str, Any]) -> Gear:
    """Read a gear file, or its content as a mapping, and merge its priors.

    In a mapping the names of tables may be left out. Later priors win: the shipped
    ones, the material's, those of certificates, those of the gear file.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    if isinstance(source, Mapping):
        path, toml = Path(_IN_MEMORY), TomlFile(_IN_MEMORY, tables_of(source))
    else:
        path, toml = Path(source), read_toml(Path(source), str(source))
    with Findings() as wrong:
        model = wrong.attempt(checked, GearFile, toml.table, toml)
        wrong += size_findings(toml)
        facts = wrong.attempt(_material, toml, path.parent)
        given = wrong.attempt(_given_priors, toml)
    assert isinstance(model, GearFile) and facts is not None and given is not None
    return _assemble(model, facts, given, path, toml)


def _assemble(
    model: GearFile,
    facts: dict[str, Prior],
    given: dict[str, Prior],
    path: Path,
    toml: TomlFile,
) -> Gear:
    sizes, measurement = model.gear, model.measurement
    shipped, stated = rig_priors(), certificate_priors(measurement.certificates)
    merged = shipped | facts | stated | given
    if gauge := stated.get("deformation_offset"):
        contact = (shipped | given)["deformation_offset"]
        merged["deformation_offset"] = contact_as_read(contact, gauge)
    radial = 0.5 if measurement.deformation == "diametral" else 1.0
    effects = {name: prior for name, prior in given.items() if "." in name}
    moving = {name: given[name] for name in DYNAMIC_UNITS if name in given}
    spring = sizes.theory == SPRING
    fact = {name: float(facts[name].numbers[0]) for name in facts}
    lengths = (
        sizes.wall_thickness_mm,
        sizes.radius_mm,
        sizes.length_mm,
        sizes.load_height_mm or sizes.length_mm,
        fact.get("poisson"),
    )
    return Gear(
        name=sizes.name or path.stem,
        geometry=Geometry(*(math.nan if one is None else one for one in lengths)),
        material=sizes.material or (NO_MATERIAL if spring else _MATERIAL),
        theory=sizes.theory,
        reading=measurement.deformation,
        reference_temperature=measurement.reference_temperature_C,
        force_resolution=measurement.force_resolution_N or 0.0,
        nominal_deformation=sizes.nominal_deformation_mm,
        priors={name: merged[name] for name in MODEL_UNITS},
        K_theory=sizes.theory if spring or "K" in given else "ring",
        source=toml.table,
        scale_priors={name: merged[name] for name in SCALE_UNITS},
        effect_priors=rig_fact_priors(model.rig, radial) | effects,
        dynamic_priors=dynamic_priors() | moving,
        density=fact.get("density"),
        gauge_priors={name: stated[name] for name in GAUGE_UNITS if name in stated},
    )


def at_full_scale(gear: Gear, full_scale: FullScale) -> Gear:
    """Return a gear with shipped priors at the scale of its rig.

    A force zero that nobody states may be anywhere: in the sum of both zeros, which is
    all that readings show, the deformation's keeps its size.
    """
    shipped = rig_priors()
    shipped["K"] = shipped["spring_stiffness"]
    own = {name: full_scale.own(shipped[name]) for name in _IN_NEWTONS}
    own["force_offset"] = full_scale.own_zero(shipped["force_offset"])
    own["K"] = full_scale.own_stiffness(shipped["K"])

    def scaled(table: dict[str, Prior]) -> dict[str, Prior]:
        of_rig = {n for n in own.keys() & table if table[n].source == shipped[n].source}
        return {n: own[n] if n in of_rig else prior for n, prior in table.items()}

    priors, scales = scaled(gear.priors), scaled(gear.scale_priors)
    return replace(gear, full_scale=full_scale, priors=priors, scale_priors=scales)


def _in_table(toml: TomlFile, name: str) -> Mapping[str, Any]:
    table = toml.table.get(name)
    return table if isinstance(table, dict) else {}


def _material(toml: TomlFile, folder: Path) -> dict[str, Prior]:
    """Return priors and facts of the material, with the modulus of a spring."""
    table, own = _in_table(toml, "gear"), {}
    if table.get("theory") == SPRING:
        shipped = rig_priors()
        own = {"E0": shipped["spring_modulus"], "K": shipped["spring_stiffness"]}
        if "material" not in table:
            return own | {"alpha": shipped["spring_alpha"]}
    return _named_material(toml, folder) | own


def _named_material(toml: TomlFile, folder: Path) -> dict[str, Prior]:
    """Return priors and facts of the material that the file names."""
    name = _in_table(toml, "gear").get("material", _MATERIAL)
    if not isinstance(name, str) or not 0 < len(name) <= 1000:
        return {}  # reported with the other types
    shipped = material_names()
    if name in shipped:
        return material_priors(name)
    if name.endswith(".toml"):
        return read_material(folder / name, name)
    # A typing error only: the nearest name may be quite another steel.
    near = get_close_matches(name, shipped, n=1, cutoff=0.85)
    hint = f"Did you mean '{near[0]}'? " if near else ""
    known = f"Available: {', '.join(shipped)} ('steel' is any steel)"
    remedy = f"{hint}{known}; for another material give the path of a .toml file"
    raise toml.error(f"unknown material '{name}'", remedy, "gear.material")


def _given_priors(toml: TomlFile) -> dict[str, Prior]:
    """Return the priors of the table [priors]; of effects by `effect.parameter`."""
    table = _in_table(toml, "priors")
    spring = _in_table(toml, "gear").get("theory") == SPRING
    units = MODEL_UNITS | SCALE_UNITS | DYNAMIC_UNITS
    units |= {"K": SPRING_UNITS["spring_stiffness"]} if spring else {}
    with Findings() as wrong:
        if "E0" in table and spring:
            words = "has no meaning under the theory 'spring'"
            remedy = "Leave it out: K is in N/mm"
            wrong.append(toml.finding(words, remedy, "priors.E0"))
            table = {name: table[name] for name in table if name != "E0"}
        priors = wrong.attempt(read_entries, table, units, toml, "priors", effects=True)
    assert priors is not None
    return priors
