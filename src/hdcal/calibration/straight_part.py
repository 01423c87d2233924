"""The straight part of a curve that is no line, over which its stiffness is asked."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.case import Case
from hdcal.screening.result import LEAST_DIFFERENCE, StraightPart

if TYPE_CHECKING:
    from hdcal.inference.checks import Check


def other_part(case: Case, stiffness: float) -> StraightPart | None:
    """Return the longest straight part where it has another stiffness than a given one.

    By more than a tenth. None where a range was chosen, and of repeated cycles and
    several runs, whose stiffness is that of all their branches.

    Args:
        case: records with their screening.
        stiffness: as read [N/mm].
    """
    found = case.screening
    part = None if found is None else found.straight
    if found is None or part is None or part.whole or found.working_range:
        return None
    if case.records.known & {"cycles", "run", "specimen"}:
        return None
    near = abs(stiffness - part.slope) <= LEAST_DIFFERENCE * abs(part.slope)
    return None if near else part


def straight_range(case: Case) -> str | None:
    """Return the working range of a straight part, by least squares of all readings.

    Args:
        case: records with their screening.
    """
    if not np.ptp(case.records.deformation):
        return None
    slope = float(np.polyfit(case.records.deformation, case.records.force, 1)[0])
    part = other_part(case, slope)
    return None if part is None else f"{part.low!r}:{part.high!r}"


def straight_check(case: Case, stiffness: np.ndarray) -> "Check":
    """Fail the one stiffness of a curve that has another one over its straight part.

    Args:
        case: records with their screening.
        stiffness: draws of the stiffness as read [N/mm], of a model without effects.
    """
    from hdcal.inference.checks import Check

    middle = float(np.median(stiffness))
    name, part = "the curve has one stiffness", other_part(case, middle)
    if part is None:
        return Check(name, "passed", "no straight part has another one")
    units = case.units
    ends = f"{part.low:.4g} to {part.high:.4g} {units.displacement_unit}"
    words = (
        f"the curve is no straight line: its longest straight part, {ends}, has "
        f"{part.slope:.4g} {units.stiffness_unit} and the model {middle:.4g}. "
        f"Choose the part by the range {part.low:.6g}:{part.high:.6g}, or all of the "
        "curve by the range all"
    )
    return Check(name, "failed", words)
