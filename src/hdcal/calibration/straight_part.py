"""The straight part of a curve that is no line, over which its stiffness is asked."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.case import Case
from hdcal.screening.result import (
    LEAST_DIFFERENCE,
    MACHINE_CLASS,
    NORMAL_95,
    StraightPart,
)

if TYPE_CHECKING:
    from hdcal.inference.checks import Check


def takes_straight_part(case: Case) -> bool:
    """Tell whether the stiffness of a curve is asked over its straight part.

    It is not where that part has the stiffness of a straight line through all readings.

    Args:
        case: records with their screening.
    """
    found, part, x = case.screening, _part(case), np.asarray(case.records.deformation)
    if found is None or found.working_range or part is None or not np.ptp(x):
        return False
    slope = float(np.polyfit(x, case.records.force, 1)[0])
    return abs(slope - part.slope) > _unsure(part, MACHINE_CLASS)


def straight_check(case: Case, stiffness: np.ndarray) -> "Check":
    """Fail the one stiffness of a curve that has another one over its straight part.

    Args:
        case: records with their screening.
        stiffness: draws of the stiffness as read [N/mm], of a model without effects.
    """
    from hdcal.inference.checks import Check

    name, part = "the curve has one stiffness", _part(case)
    middle = float(np.median(stiffness))
    if part is None or abs(middle - part.slope) <= _unsure(part, LEAST_DIFFERENCE):
        return Check(name, "passed", "no straight part has another one")
    units = case.units
    ends = f"{part.low:.4g} to {part.high:.4g} {units.displacement_unit}"
    words = (
        f"the curve is no straight line: its longest straight part, {ends}, has "
        f"{part.slope:.4g} {units.stiffness_unit} and the model {middle:.4g}. "
        "Choose the longest straight part of the record by the range straight, another "
        "one by its ends, or all of the curve by the range all"
    )
    return Check(name, "failed", words)


def _part(case: Case) -> StraightPart | None:
    """Return the longest straight part, in the range, of a curve that is no line.

    None where all of the curve, or its straight part, was chosen.
    """
    found = case.screening
    if found is None:
        return None
    part = found.straight_in_range if found.working_range else found.straight
    return None if part is None or part.whole else part


def _unsure(part: StraightPart, share: float) -> float:
    """Return the difference from a part's stiffness that counts [N/mm]."""
    return max(NORMAL_95 * part.slope_sd, share * abs(part.slope))
