"""Limits of requests, and what is impossible for a gear: the context of validation."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from hdcal.data.gear_file.validation import fault, within
from hdcal.design.gears import Gears
from hdcal.errors import Finding
from hdcal.prediction.conditions import temperature_findings
from hdcal.prediction.sizes import SIZES, check_tolerances, matters
from hdcal.report.item import Item

# Draws that have to fall outside for a probability to be estimated.
_LEAST_OUTSIDE = 10


def gears_of(info: ValidationInfo) -> Gears:
    """Return the gears for which a request is validated."""
    gears: Any = info.context
    return gears


def _nominal(given: Any, info: ValidationInfo) -> Any:
    nominal = gears_of(info).gear.nominal_deformation
    if given is not None:
        return given
    if nominal is None:
        words = "the gear file states no nominal deformation"
        raise fault(words, "Give a deformation in mm, such as 0.4")
    # The gear file states it as read.
    return nominal * gears_of(info).radial_per_read


def _refuse(findings: list[Finding]) -> None:
    for finding in findings:
        raise fault(finding.problem, finding.remedy)


def _possible(temperature: float, info: ValidationInfo) -> float:
    gears, levels = gears_of(info), np.array([temperature])
    _refuse(temperature_findings(gears.gear, gears.model.draws, levels))
    return temperature


def _with_reference(given: Any, info: ValidationInfo) -> list[float]:
    reference = gears_of(info).gear.reference_temperature
    levels = [reference] if given is None or not len(given) else list(given)
    inside = min(levels) < reference < max(levels)
    return sorted({*map(float, levels), *([reference] if inside else [])})


def _countable(probability: float, info: ValidationInfo) -> float:
    size = gears_of(info).independent
    if (1.0 - probability) * size < _LEAST_OUTSIDE * (1.0 - 1e-9):
        words = f"{probability:g} cannot be estimated from {size:.0f} independent draws"
        most = 1.0 - _LEAST_OUTSIDE / size
        raise fault(words, f"Ask for {most:.4g} or less, or calibrate with more draws")
    return probability


def _of_sizes(tolerances: dict, info: ValidationInfo) -> dict:
    gears = gears_of(info)
    _refuse(check_tolerances(tolerances, gears.gear.geometry, gears.theory))
    return tolerances


def ascending(ends: tuple[float, float]) -> tuple[float, float]:
    """Require two ends in ascending order."""
    if not ends[0] < ends[1]:
        raise fault(f"{ends[0]:g}:{ends[1]:g} is empty", "Write LO:HI")
    return ends


SizeName = Literal["wall_thickness_mm", "radius_mm", "length_mm", "load_height_mm"]
Size = Annotated[float, within("size")]
Bounds = Annotated[tuple[Size, Size], AfterValidator(ascending)]
# Radial, of the gear itself [mm].
Deformation = Annotated[float, within("deformation")]
NominalDeformation = Annotated[Deformation, BeforeValidator(_nominal)]
Window = Annotated[tuple[Deformation, Deformation], AfterValidator(ascending)]
Temperature = Annotated[float, AfterValidator(_possible)]
_Levels = Annotated[
    tuple[Temperature, ...], BeforeValidator(_with_reference), Field(max_length=1000)
]
_Probability = Annotated[float, within("probability"), AfterValidator(_countable)]
_Tolerances = Annotated[dict[SizeName, float], AfterValidator(_of_sizes)]


class Asked(Item):
    """A request for gears that hold at all temperatures, with a probability."""

    temperature_C: _Levels = Field(validation_alias="temperatures")
    probability: _Probability
    tolerances_mm: _Tolerances = Field(validation_alias="tolerances")


def check_sizes(gears: Gears, sizes: Mapping[Any, Any], deformation: Any) -> None:
    """Require sizes [mm], by name, that are possible in every combination."""
    for name in sizes:
        if not matters(SIZES[name], gears.gear.geometry, gears.theory):
            words = f"{name} has no influence under the theory '{gears.theory}'"
            raise fault(words, "Leave it out, or use the theory cup")
    least, most = (
        {name: float(end(sizes.get(name, gears.size_of(name)))) for name in SIZES}
        for end in (np.min, np.max)
    )
    if most["wall_thickness_mm"] >= least["radius_mm"]:
        raise fault(
            "the wall thickness is not less than the radius", "Check both sizes"
        )
    if "load_height_mm" in sizes and most["load_height_mm"] > least["length_mm"]:
        words = "the load acts beyond the length of the gear"
        raise fault(words, "State the load height from the closed base")
    if np.max(np.abs(deformation)) >= least["radius_mm"]:
        words = f"the deformation reaches the radius of {least['radius_mm']:g} mm"
        raise fault(words, "Give the deformation in mm")
