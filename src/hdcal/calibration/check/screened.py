"""What the screening of a record found, as part of a result."""

import numpy as np
from pydantic import Field

from hdcal.report.item import Count, Item, Words
from hdcal.screening.result import SEGMENTS, Screening


class ScreenedFinding(Item, from_attributes=True):
    """A finding of the screening: what it is, where, how large, and what was done."""

    kind: str
    rows: str = Field(validation_alias="where")
    row_count: Count = Field(validation_alias="count")
    size: float
    unit: str
    action: str
    words: Words


class StraightRange(Item):
    """The longest straight part of the curve.

    Attributes:
        deformation_mm: its ends, as read.
        stiffness_N_per_mm: slope of a straight line there.
        standard_error_N_per_mm: of that slope.
        whole: whether the whole curve is straight.
    """

    deformation_mm: tuple[float, float]
    stiffness_N_per_mm: float
    standard_error_N_per_mm: float
    whole: bool


class Screened(Item):
    """What the screening found, with the number of rows of each segment."""

    findings: tuple[ScreenedFinding, ...]
    segments: dict[str, Count]
    working_range: str
    straight_part: StraightRange | None


def screened(found: Screening | None) -> Screened | None:
    """Return a screening as part of a result; None where there was none."""
    if found is None:
        return None
    part, rows = found.straight, np.bincount(found.segment, minlength=len(SEGMENTS))
    straight = part and StraightRange(
        deformation_mm=(part.low, part.high),
        stiffness_N_per_mm=part.slope,
        standard_error_N_per_mm=part.slope_sd,
        whole=part.whole,
    )
    return Screened(
        findings=tuple(map(ScreenedFinding.model_validate, found.observations)),
        segments={n: int(k) for n, k in zip(SEGMENTS, rows, strict=True) if k},
        working_range=found.working_range,
        straight_part=straight,
    )
