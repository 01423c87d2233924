"""Read the gear file: sizes, how it was measured, and what is believed of it."""

import math
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

from hdcal.data.case import Gear
from hdcal.data.certificates import GAUGE_UNITS, certificate_priors, contact_as_read
from hdcal.data.full_scale import FullScale
from hdcal.data.gear_schema import (
    GearFile,
    GearTable,
    check_schema,
    size_findings,
    tables_of,
    with_reading,
)
from hdcal.data.prior import Prior
from hdcal.data.prior_entry import read_prior
from hdcal.data.priors import (
    DYNAMIC_UNITS,
    MATERIAL_UNITS,
    MODEL_UNITS,
    SCALE_UNITS,
    SPRING_UNITS,
    dynamic_priors,
    effect_priors,
    material_names,
    material_priors,
    read_effect_priors,
    read_priors,
    rig_priors,
)
from hdcal.data.records import Geometry
from hdcal.data.rig_facts import rig_fact_priors
from hdcal.data.theory_names import SPRING, Theory
from hdcal.data.toml_file import TomlFile, did_you_mean, read_toml
from hdcal.errors import Finding, Findings, InputError

# Shipped priors of the base model that are written for a full scale.
IN_NEWTONS = ("sigma", "run_offset_sd", "gap_sd")
# The material of a spring that names none.
NO_MATERIAL = "not stated"
# That of any other gear that names none.
_MATERIAL = "steel"
# What findings call a gear that no file describes.
IN_MEMORY = "gear"
# The name of a part of which no size is known.
PART = "part"


def unsized() -> Gear:
    """Return a part of which nothing is known: a spring of any stiffness."""
    return read_gear({"name": PART, "theory": SPRING})


def read_gear(
    source: Path | str | Mapping[str, Any],
    theory: str | None = None,
    material: Path | None = None,
    reading: str | None = None,
) -> Gear:
    """Read a gear file, or what would stand in one, and merge its priors.

    Later ones win: shipped rig priors, the material's, those of certificates, those
    of the gear file. The certificate of a displacement gauge replaces no prior: it
    adds to the error of the contact point.
    An influence coefficient K in the file refers to the theory in the file, the
    shipped one to `ring`. Under `spring` there is a shipped stiffness instead, sizes
    that are not in the file are NaN, and a material says how the stiffness changes
    with temperature.

    Args:
        source: the TOML file; or its tables as a mapping, where the names of the tables
            may be left out, as in `{"radius_mm": 40.0, "deformation": "radial"}`.
        theory: overrides the theory that K multiplies, not what K's prior means.
        material: stands for the material file that the gear names, wherever that is.
        reading: of the deformation, `radial` or `diametral`, where the file is silent.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    if isinstance(source, Mapping):
        path = Path(IN_MEMORY)
        toml = TomlFile(IN_MEMORY, tables_of(source), "")
    else:
        path = Path(source)
        toml = read_toml(path, str(path))
    with Findings() as wrong:
        toml = wrong.attempt(with_reading, toml, reading) or toml
        model = wrong.attempt(check_schema, toml)
        wrong += size_findings(toml, theory)
        if theory is not None and theory not in get_args(Theory):
            remedy = did_you_mean(theory, list(get_args(Theory)))
            wrong.append(Finding("theory", f"unknown theory '{theory}'", remedy))
        spring = _in_gear(toml, "theory", theory) == SPRING
        facts = wrong.attempt(_material, toml, path.parent, material, spring=spring)
        given = wrong.attempt(_given_priors, toml, spring=spring)
        wrong += _of_another_theory(toml, theory)
    assert model is not None and facts is not None and given is not None
    return _assemble(model, theory, facts, given, path, toml)


def _assemble(
    model: GearFile,
    theory: str | None,
    facts: dict[str, Prior],
    own: tuple[dict[str, Prior], dict[str, Prior]],
    path: Path,
    toml: TomlFile,
) -> Gear:
    sizes, measurement = model.gear, model.measurement
    given, effects = own
    stated = certificate_priors(measurement.certificates)
    merged = rig_priors() | facts | stated | given
    if gauge := stated.get("deformation_offset"):
        contact = (rig_priors() | given)["deformation_offset"]
        merged["deformation_offset"] = contact_as_read(contact, gauge)
    radial = 0.5 if measurement.deformation == "diametral" else 1.0
    sharper = rig_fact_priors(model.rig, effect_priors(), radial)
    moving = {name: given[name] for name in DYNAMIC_UNITS if name in given}
    chosen: Any = theory or sizes.theory
    return Gear(
        name=sizes.name or path.stem,
        geometry=_geometry(sizes, facts),
        material=sizes.material or (NO_MATERIAL if chosen == SPRING else _MATERIAL),
        theory=chosen,
        reading=measurement.deformation,
        reference_temperature=measurement.reference_temperature_C,
        force_resolution=measurement.force_resolution_N or 0.0,
        nominal_deformation=sizes.nominal_deformation_mm,
        priors={name: merged[name] for name in MODEL_UNITS},
        K_theory=_theory_of_K(sizes, chosen, given),
        source=toml.table,
        scale_priors={name: merged[name] for name in SCALE_UNITS},
        effect_priors=sharper | effects,
        dynamic_priors=dynamic_priors() | moving,
        density=float(facts["density"].numbers[0]) if "density" in facts else None,
        gauge_priors={name: stated[name] for name in GAUGE_UNITS if name in stated},
    )


def _geometry(sizes: GearTable, facts: dict[str, Prior]) -> Geometry:
    """Return the sizes; those that a spring does not state are NaN."""
    stated = {
        "wall_thickness": sizes.wall_thickness_mm,
        "radius": sizes.radius_mm,
        "length": sizes.length_mm,
        "load_height": sizes.load_height_mm or sizes.length_mm,
        "poisson": float(facts["poisson"].numbers[0]) if "poisson" in facts else None,
    }
    return Geometry(
        **{name: math.nan if size is None else size for name, size in stated.items()}
    )


def _theory_of_K(sizes: GearTable, chosen: Theory, given: dict[str, Prior]) -> Theory:
    if chosen == SPRING:
        return SPRING
    return sizes.theory if "K" in given else "ring"


def at_full_scale(gear: Gear, full_scale: FullScale) -> Gear:
    """Return a gear whose shipped priors are those of its own rig.

    What the gear file states stays. A force zero that nobody states may be anywhere:
    in the sum of both zeros, which is all that readings show, the deformation's keeps
    its own size.
    """
    shipped = rig_priors()

    def own(table: dict[str, Prior]) -> dict[str, Prior]:
        return table | {
            name: full_scale.own(shipped[name])
            for name in IN_NEWTONS
            if name in table and table[name].source == shipped[name].source
        }

    zero, stiffness = shipped["force_offset"], shipped["spring_stiffness"]
    if gear.priors["force_offset"].source == zero.source:
        wide = {"force_offset": full_scale.own_zero(zero)}
        gear = replace(gear, priors=gear.priors | wide)
    if gear.priors["K"].source == stiffness.source:
        own_K = {"K": full_scale.own_stiffness(stiffness)}
        gear = replace(gear, priors=gear.priors | own_K)
    tables = {"priors": own(gear.priors), "scale_priors": own(gear.scale_priors)}
    return replace(gear, full_scale=full_scale, **tables)


def _in_gear(toml: TomlFile, key: str, given: Any = None) -> Any:
    """Return what the table [gear] holds, whatever that is; what is given wins."""
    table = toml.table.get("gear")
    return given or (table.get(key) if isinstance(table, dict) else None)


def _material(
    toml: TomlFile, folder: Path, given: Path | None, *, spring: bool
) -> dict[str, Prior]:
    """Priors and facts of the material, with the modulus of the theory `spring`."""
    own = {}
    if spring:
        shipped = rig_priors()
        own = {"E0": shipped["spring_modulus"], "K": shipped["spring_stiffness"]}
        if _in_gear(toml, "material") is None:
            return own | {"alpha": shipped["spring_alpha"]}
    return _named_material(toml, folder, given) | own


def _named_material(
    toml: TomlFile, folder: Path, given: Path | None
) -> dict[str, Prior]:
    """Priors and facts of the material that the gear file names, or of a given one."""
    name = _in_gear(toml, "material")
    name = _MATERIAL if name is None else name
    if not isinstance(name, str) or not 0 < len(name) <= 1000:
        return {}  # reported with the other types
    shipped = material_names()
    if name in shipped:
        return material_priors(name)
    if not name.endswith(".toml"):
        words = f"unknown material '{name}'"
        # A slip of the pen only: the nearest name may be quite another steel.
        near = get_close_matches(name, shipped, n=1, cutoff=0.85)
        hint = f"Did you mean '{near[0]}'? " if near else ""
        known = f"Shipped are: {', '.join(shipped)}; 'steel' is any steel"
        remedy = f"{hint}{known}; for another one give the path of a .toml file"
        raise toml.error(words, remedy, "gear.material")
    facts = read_priors(given or folder / name, MATERIAL_UNITS, name)
    lacking = [need for need in ("E0", "alpha", "poisson") if need not in facts]
    if lacking:
        words = "the material says nothing of " + " and ".join(lacking)
        remedy = 'Write a table for each, such as [poisson] family = "fixed"'
        raise InputError([Finding(name, words, remedy)])
    ratio = facts["poisson"]
    if ratio.family != "fixed" or not ratio.numbers[0] < 0.5:
        words, remedy = "is not a number below 0.5", 'Write family = "fixed"'
        raise InputError([Finding(name, words, remedy, None, "poisson")])
    return facts


def _of_another_theory(toml: TomlFile, theory: str | None) -> list[Finding]:
    """Say so where K is given under a theory that cannot be carried over."""
    own, table = _in_gear(toml, "theory") or "ring", toml.table.get("priors")
    given = isinstance(table, dict) and "K" in table
    if not given or theory is None or (theory == SPRING) == (own == SPRING):
        return []
    words = f"is given under the theory '{own}', which says nothing of '{theory}'"
    return [toml.finding(words, f"Keep the theory '{own}'", "priors.K")]


def _given_priors(
    toml: TomlFile, *, spring: bool
) -> tuple[dict[str, Prior], dict[str, Prior]]:
    """Priors of the table [priors]: the gear's and the rig's, and the effects'."""
    given: dict[str, Prior] = {}
    tables: dict[str, dict] = {}
    units = MODEL_UNITS | SCALE_UNITS | DYNAMIC_UNITS
    if spring:
        units = units | {"K": SPRING_UNITS["spring_stiffness"]}
    table = toml.table.get("priors")
    with Findings() as wrong:
        for name, entry in table.items() if isinstance(table, dict) else ():
            key = f"priors.{name}"
            effect, dot, parameter = name.partition(".")
            if name == "E0" and spring:
                words = "has no meaning under the theory 'spring'"
                wrong.append(toml.finding(words, "Leave it out: K is in N/mm", key))
            elif name in units:
                if prior := wrong.attempt(read_prior, entry, key, toml, units[name]):
                    given[name] = prior
            elif dot:
                tables.setdefault(effect, {})[parameter] = entry
            elif isinstance(entry, dict) and "family" not in entry:
                tables.setdefault(name, {}).update(entry)
            else:
                remedy = (
                    did_you_mean(name, list(units)) + "; or a table [priors.EFFECT]"
                )
                wrong.append(toml.finding("unknown key", remedy, key))
        effects = wrong.attempt(read_effect_priors, tables, "priors", toml)
    assert effects is not None
    return given, effects
