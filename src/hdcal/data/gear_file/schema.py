"""The schema of the gear file."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field

from hdcal.data.gear_file.certificates import (
    DeformationCertificate,
    ForceCertificate,
    GaugeCertificate,
    TemperatureCertificate,
)
from hdcal.data.gear_file.rig_facts import RigTable
from hdcal.data.gear_file.toml_file import TomlFile
from hdcal.data.gear_file.validation import STRICT, fault, within
from hdcal.data.plausible import range_of
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.screening.working_range import FORM, read_range

_Size = Annotated[float, within("size")]
# Sizes that every theory but `SPRING` needs.
SIZES_NEEDED = ("wall_thickness_mm", "radius_mm", "length_mm")


def _checked_range(text: str) -> str:
    try:
        read_range(text)
    except ValueError as error:
        raise fault(str(error), FORM) from None
    return text


class GearTable(BaseModel):
    """The table [gear]; lengths in mm. Its sizes may be missing from a spring alone."""

    model_config = STRICT
    name: Annotated[str, Field(max_length=200)] = ""
    wall_thickness_mm: _Size | None = None
    radius_mm: _Size | None = None
    length_mm: _Size | None = None
    nominal_deformation_mm: _Size | None = None
    load_height_mm: _Size | None = None
    material: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    theory: Theory = "ring"


class MeasurementTable(BaseModel):
    """The table [measurement]."""

    model_config = STRICT
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
    """A whole gear file; `read_entries` reads its priors."""

    model_config = STRICT
    gear: GearTable
    measurement: MeasurementTable = MeasurementTable()
    rig: RigTable = RigTable()
    columns: dict[str, Annotated[str, Field(max_length=1000)]] = {}
    priors: dict[str, Any] = {}


def tables_of(source: Mapping[Any, Any]) -> dict[str, Any]:
    """Return the tables of a gear file from a mapping, with or without their names."""
    plain = _with_text_keys(source)
    tables = {"gear": {}} | {n: plain[n] for n in GearFile.model_fields if n in plain}
    for key in plain.keys() - GearFile.model_fields.keys():
        name = "measurement" if key in MeasurementTable.model_fields else "gear"
        table = tables.setdefault(name, {})
        if not isinstance(table, dict):
            continue  # refused by the schema
        if key in table:
            words = f"is stated twice, outside and inside the table [{name}]"
            raise InputError([Finding(key, words, "State it once")])
        table[key] = plain[key]
    return tables


def _with_text_keys(table: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a copy of a table and those inside it; other keys become unknown ones."""
    return {
        str(key): _with_text_keys(value) if isinstance(value, Mapping) else value
        for key, value in table.items()
    }


def certificates_in(table: Mapping[str, Any]) -> dict[str, GaugeCertificate]:
    """Return the certificates in the tables of a gear file that was checked."""
    return MeasurementTable.model_validate(table.get("measurement", {})).certificates


def size_findings(toml: TomlFile) -> list[Finding]:
    """Return sizes that are missing, and relations between those that are there."""
    table = toml.table.get("gear")
    if not isinstance(table, dict):
        return []
    needed = () if table.get("theory") == SPRING else SIZES_NEEDED
    other = f"; or use theory = '{SPRING}', which needs no sizes"
    findings = [
        toml.finding("is missing", f"Add it: {name} = …{other}", f"gear.{name}")
        for name in needed
        if name not in table
    ]
    numbers = {
        name.removesuffix("_mm"): value
        for name, value in table.items()
        if type(value) in (int, float) and range_of("size").holds(value)
    }
    return findings + [
        toml.finding(words, remedy, f"gear.{name}_mm")
        for name, words, remedy in size_faults(numbers)
    ]


def size_faults(size: Mapping[str, float]) -> list[tuple[str, str, str]]:
    """Return which sizes contradict the others: name, problem and remedy."""
    radius = size.get("radius", math.inf)
    both = "Check both sizes"
    faults = [
        ("wall_thickness", "the wall thickness is not less than the radius", both),
        ("nominal_deformation", "the deformation is not less than the radius", both),
    ]
    faults = [fault for fault in faults if size.get(fault[0], 0.0) >= radius]
    if size.get("load_height", 0.0) > size.get("length", math.inf):
        words = "the load acts beyond the length of the gear"
        remedy = "State the load height from the closed base"
        faults.append(("load_height", words, remedy))
    return faults
