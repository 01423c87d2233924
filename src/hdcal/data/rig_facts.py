"""Facts of a rig that sharpen priors of the diagnosis: the table [rig]."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict

from hdcal.data.full_scale import REFERENCE, FullScale
from hdcal.data.prior import Prior
from hdcal.data.typed_json import within

# Of a pitch by its drawing.
_PITCH_LOG_SD = 0.02


class RigTable(BaseModel):
    """The table [rig]; each fact sharpens a prior, none is needed."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False
    )
    load_cell_capacity_N: Annotated[float, within("load_cell_capacity")] | None = None
    gauge_range_mm: Annotated[float, within("size")] | None = None
    displacement_pitch_mm: Annotated[float, within("size")] | None = None
    filter_Hz: Annotated[float, within("filter")] | None = None


def rig_fact_priors(
    facts: RigTable, shipped: dict[str, Prior], radial_per_read: float
) -> dict[str, Prior]:
    """Return the effects' priors that a rig's facts sharpen, by `effect.parameter`.

    An error of a gauge is a share of its range, not of what was read of it.

    Args:
        facts: of the rig, its deformations as read.
        shipped: the shipped priors of the effects, for `REFERENCE`.
        radial_per_read: radial deformation per deformation as read.
    """
    found = {}
    if capacity := facts.load_cell_capacity_N:
        own = FullScale(capacity, REFERENCE.deformation)
        source = "[rig] load_cell_capacity_N: the shipped share, lost at capacity"
        found["force_saturation.curvature"] = (own, source)
    if reach := facts.gauge_range_mm:
        own = FullScale(REFERENCE.force, reach * radial_per_read)
        source = "[rig] gauge_range_mm: the shipped linearity error, of the range"
        found["displacement_nonlinearity.curvature"] = (own, source)
    priors = {
        name: _sourced(scale.own(shipped[name]), source)
        for name, (scale, source) in found.items()
    }
    if pitch := facts.displacement_pitch_mm:
        numbers = (pitch * radial_per_read, _PITCH_LOG_SD)
        source = "[rig] displacement_pitch_mm"
        priors["screw_error.pitch"] = Prior("lognormal", numbers, "mm", source)
    return priors


def _sourced(prior: Prior, source: str) -> Prior:
    return Prior(prior.family, prior.numbers, prior.unit, source)
