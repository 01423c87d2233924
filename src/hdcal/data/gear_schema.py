"""The schema of the gear file, and its errors in the user's words."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from hdcal.data.certificates import (
    DeformationCertificate,
    ForceCertificate,
    GaugeCertificate,
    TemperatureCertificate,
    certificate_faults,
)
from hdcal.data.plausible import NAMES, RANGES, implausible, range_of
from hdcal.data.rig_facts import RigTable
from hdcal.data.theory_names import READINGS, SPRING, Theory
from hdcal.data.toml_file import TomlFile, did_you_mean
from hdcal.data.typed_json import within
from hdcal.errors import Finding, Findings, InputError
from hdcal.screening.working_range import FORM, read_range

_STRICT = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


_Size = Annotated[float, within("size")]
# What no theory but `SPRING` can do without.
SIZES_NEEDED = ("wall_thickness_mm", "radius_mm", "length_mm")


class GearTable(BaseModel):
    """The table [gear]; lengths in mm. Its sizes may be missing from a spring alone."""

    model_config = _STRICT
    name: Annotated[str, Field(max_length=200)] = ""
    wall_thickness_mm: _Size | None = None
    radius_mm: _Size | None = None
    length_mm: _Size | None = None
    nominal_deformation_mm: _Size | None = None
    load_height_mm: _Size | None = None
    material: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    theory: Theory = "ring"


def _checked_range(text: str) -> str:
    read_range(text)
    return text


class MeasurementTable(BaseModel):
    """The table [measurement]."""

    model_config = _STRICT
    deformation: Literal["radial", "diametral"] = "radial"
    reference_temperature_C: Annotated[float, within("temperature")] = 20.0
    force_resolution_N: Annotated[float, within("force_resolution")] | None = None
    force_calibration: ForceCertificate | None = None
    deformation_calibration: DeformationCertificate | None = None
    temperature_calibration: TemperatureCertificate | None = None
    range: Annotated[str, AfterValidator(_checked_range)] | None = None

    @property
    def certificates(self) -> dict[str, GaugeCertificate]:
        """The certificates that are there, by their keys."""
        return {n: one for n, one in self if isinstance(one, GaugeCertificate)}


class GearFile(BaseModel):
    """A whole gear file; priors have a reader of their own."""

    model_config = _STRICT
    gear: GearTable
    measurement: MeasurementTable = MeasurementTable()
    rig: RigTable = RigTable()
    columns: dict[str, Annotated[str, Field(max_length=1000)]] = {}
    priors: dict[str, Any] = {}


def check_schema(toml: TomlFile) -> GearFile:
    """Return the tables of a gear file, typed.

    Raises:
        InputError: holds everything that is missing, unknown or of a wrong type.
    """
    try:
        found = GearFile.model_validate(toml.table)
    except ValidationError as error:
        findings = [_translate(dict(item), toml) for item in error.errors()]
        raise InputError(findings) from None
    with Findings() as wrong:
        for key, words, remedy in certificate_faults(found.measurement.certificates):
            wrong.append(toml.finding(words, remedy, f"measurement.{key}"))
    return found


def tables_of(source: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a gear file from a mapping that may leave out their names.

    A key that no table has is put into [gear], where the schema refuses it.
    """
    found: dict[str, Any] = {"gear": {}}
    found |= {key: source[key] for key in source if key in GearFile.model_fields}
    for key, value in source.items():
        if key in GearFile.model_fields:
            continue
        name = "measurement" if key in MeasurementTable.model_fields else "gear"
        table = found.get(name, {})
        if not isinstance(table, Mapping):
            continue  # refused by the schema
        if key in table:
            words = f"is stated twice, alone and in the table [{name}]"
            raise InputError([Finding(key, words, "State it once")])
        found[name] = {**table, key: value}
    return found


def certificates_in(table: Mapping[str, Any]) -> dict[str, GaugeCertificate]:
    """Return the certificates in the tables of a gear file that was checked."""
    return MeasurementTable.model_validate(table.get("measurement", {})).certificates


def _translate(error: dict, toml: TomlFile) -> Finding:
    """One of pydantic's errors in the words of the gear file."""
    key = ".".join(str(part) for part in error["loc"])
    kind, value = error["type"], error["input"]
    if kind == "extra_forbidden":
        *table, name = error["loc"]
        known = list(_model_of(table).model_fields)
        return toml.finding("unknown key", did_you_mean(name, known), key)
    if kind == "missing":
        return toml.finding("is missing", f"Add it: {_example(key)}", key)
    if kind == "literal_error":
        remedy = did_you_mean(
            str(value), re.findall(r"'([^']+)'", error["ctx"]["expected"])
        )
        return toml.finding(f"unknown choice '{value}'", remedy, key)
    if kind in ("greater_than_equal", "less_than_equal"):
        name = key.rpartition(".")[2]
        quantity = name if name in (*RANGES, *NAMES) else name.rpartition("_")[0]
        (found,) = implausible(key, value, quantity)
        return toml.finding(found.problem, found.remedy, key)
    if kind == "value_error" and key == "measurement.range":
        return toml.finding(str(error["ctx"]["error"]), FORM, key)
    words = error["msg"][:1].lower() + error["msg"][1:]
    return toml.finding(words, f"Write it like {_example(key)}", key)


def _model_of(table: list[str]) -> Any:
    """Return the model of a table of the gear file."""
    model: Any = GearFile
    for name in table:
        kind = model.model_fields[name].annotation
        # A table that may be missing is "this one, or nothing".
        model = next(iter(get_args(kind)), kind)
    return model


def _example(key: str) -> str:
    name = key.rpartition(".")[2]
    examples = {
        "gear": "[gear]",
        "measurement": "[measurement]",
        "priors": "[priors]",
        "name": 'name = "XB1-100-80"',
        "material": 'material = "steel"',
        "theory": 'theory = "ring"',
        "deformation": 'deformation = "radial"',
        "force_calibration": "force_calibration = { expanded_percent = 0.5, k = 2 }",
        "deformation_calibration": "deformation_calibration = { expanded_mm = 0.002 }",
        "range": 'range = "10%:40%"',
        "temperature_calibration": "temperature_calibration = { expanded_K = 1.0 }",
    }
    return examples.get(name, f"{name} = … (a number)")


def size_findings(toml: TomlFile, theory: str | None = None) -> list[Finding]:
    """Sizes that are missing, and relations between those that are there.

    Checked whatever else is wrong.

    Args:
        toml: the gear file.
        theory: overrides the one in the file.
    """
    table = toml.table.get("gear")
    if not isinstance(table, dict):
        return []
    missing = [name for name in SIZES_NEEDED if name not in table]
    size = {
        name.removesuffix("_mm"): value
        for name, value in table.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
        if range_of("size").holds(value)
    }
    other = ""
    if table.get("theory") == SPRING:
        other = f"; or keep the theory '{SPRING}' of the file, which needs none"
    elif missing == [*SIZES_NEEDED]:
        other = f"; or take the theory '{SPRING}', which needs none"
    lacking = [
        toml.finding("is missing", f"Add it: {_example(name)}{other}", f"gear.{name}")
        for name in missing
        if (theory or table.get("theory")) != SPRING
    ]
    return lacking + [
        toml.finding(words, remedy, f"gear.{name}_mm")
        for name, words, remedy in size_faults(size)
    ]


def size_faults(size: Mapping[str, float]) -> list[tuple[str, str, str]]:
    """Return which sizes cannot be beside the others: name, problem and remedy.

    Args:
        size: by name [mm]; any may be missing.
    """
    radius = size.get("radius", math.inf)
    both = "Check both sizes"
    faults = [
        ("wall_thickness", "the wall is not thinner than the radius", both),
        ("nominal_deformation", "the deformation is not below the radius", both),
    ]
    faults = [fault for fault in faults if size.get(fault[0], 0.0) >= radius]
    if size.get("load_height", 0.0) > size.get("length", math.inf):
        words = "the load acts beyond the length of the gear"
        remedy = "Measure the load height from the closed base"
        faults.append(("load_height", words, remedy))
    return faults


def with_reading(toml: TomlFile, reading: str | None) -> TomlFile:
    """Return a gear file that says how the deformation is read, where it is silent.

    Raises:
        InputError: there is no such reading, or the file says another one.
    """
    measurement = toml.table.get("measurement", {})
    if reading is None or not isinstance(measurement, dict):
        return toml
    said = measurement.get("deformation", reading)
    if reading not in READINGS:
        remedy = f"It is {' or '.join(READINGS)}"
        raise InputError([Finding("reading", f"there is no '{reading}'", remedy)])
    if said != reading:
        words = f"'{reading}' was asked for, and the gear file says '{said}'"
        raise InputError([Finding("reading", words, "Correct the one that is wrong")])
    told = {"measurement": {**measurement, "deformation": reading}}
    return replace(toml, table={**toml.table, **told})
