"""The working range: between which deformations or forces a stiffness is asked."""

import math
import re
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from hdcal.quantities import Quantities
from hdcal.screening.branches import straight_part
from hdcal.screening.result import (
    OUTSIDE,
    Observation,
    Screening,
    StraightPart,
    stretches,
)
from hdcal.screening.run import Run

_ENDS = re.compile(r"\s*([^:%\s]+)\s*(%?)\s*:\s*([^:%\s]+)\s*(%?)\s*")
FORM = (
    "Write it like 0.1:0.6 in mm (angles in rad), like 10%:40% of the largest force, "
    "straight for the longest straight part, or all"
)
STRAIGHT = "straight"


@dataclass(frozen=True)
class WorkingRange:
    """Ends of the working range."""

    low: float
    high: float
    # Of the deformation as read, the largest force of a run, or the straight part.
    unit: Literal["mm", "%", "straight"]
    one_branch: bool = False  # rows of other branches between the ends are cut

    def words(self, units: Quantities) -> str:
        """Return the range in words."""
        if math.isinf(self.high):
            return "all of the curve"
        if self.unit == "%":
            ends = f"{self.low:g} to {self.high:g} %"
            return f"{ends} of the largest {units.load}"
        ends = f"{self.low:g} to {self.high:g} {units.displacement_unit}"
        return f"{ends} of one branch" if self.one_branch else ends

    def inside(self, deformation: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Tell which rows of a run lie in the range, from its readings, (n,)."""
        if self.unit == "mm":
            return (deformation >= self.low) & (deformation <= self.high)
        size = np.abs(force)
        share = 100.0 * size / size.max(initial=math.ulp(0.0))
        return (share >= self.low) & (share <= self.high)


def read_range(text: str) -> WorkingRange:
    """Read LOW:HIGH in mm (rad) or %, `straight` or `all`; else raise ValueError."""
    if text.strip() in ("all", STRAIGHT):
        unit = "mm" if text.strip() == "all" else STRAIGHT
        return WorkingRange(-math.inf, math.inf, unit)
    found = _ENDS.fullmatch(text)
    try:
        low, high = (float(found[i]) for i in (1, 3)) if found else (math.inf, math.inf)
    except ValueError:
        low = high = math.inf
    if found is None or not (math.isfinite(low) and math.isfinite(high)):
        raise ValueError(f"'{text}' is not a range")
    if bool(found[2]) != bool(found[4]):
        raise ValueError(f"'{text}' has % at one end only")
    unit = "%" if found[2] else "mm"
    if not low < high:
        raise ValueError(f"the lower end of '{text}' is not below the upper one")
    if unit == "%" and not 0.0 <= low < high <= 100.0:
        raise ValueError(f"'{text}' is not between 0 and 100 %")
    return WorkingRange(low, high, unit)


def in_range(
    screening: Screening, wanted: WorkingRange, run: np.ndarray, units: Quantities
) -> Screening:
    """Return a screening without the rows outside a range; run is their index, (n,)."""
    part = screening.straight
    if wanted.unit == STRAIGHT and part is not None:
        inside, x = part.rows, screening.deformation
        others = screening.kept & ~inside & (x >= part.low) & (x <= part.high)
        branch = bool(others.any()) and not screening.deformation_sd
        wanted = WorkingRange(part.low, part.high, "mm", branch)
        part = None
    else:
        inside = np.zeros(run.size, bool)
        for index in np.unique(run):
            rows = np.flatnonzero((run == index) & screening.kept)
            x, y = screening.deformation[rows], screening.force[rows]
            inside[rows] = wanted.inside(x, y)
    outside = np.flatnonzero(screening.kept & ~inside)
    if not outside.size:
        return replace(screening, working_range=wanted.words(units))
    segment = screening.segment.copy()
    segment[outside] = OUTSIDE
    width, rows = wanted.high - wanted.low, stretches(outside)
    observed = Observation("outside the range", rows, width, wanted.unit, "cut")
    return replace(
        screening,
        observations=(*screening.observations, observed),
        segment=segment,
        kept=inside,
        working_range=wanted.words(units),
        straight_in_range=None if part is None else _straight(screening, inside),
    )


def _straight(screening: Screening, inside: np.ndarray) -> StraightPart | None:
    """Return the longest straight part of some rows of a record of one run."""
    rows = np.flatnonzero(inside)
    one = Run.of(rows, screening.deformation, screening.force)
    one.scatter = screening.deformation_sd
    return straight_part(one, inside.size)
