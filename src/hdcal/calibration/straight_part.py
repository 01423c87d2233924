"""The straight part of a curve that is no line, over which its stiffness is asked."""

import numpy as np

from hdcal.data.case import Case
from hdcal.inference.checks import Check
from hdcal.inference.straight_line import LEAST_DIFFERENCE


def straight_range(case: Case) -> str | None:
    """Return the working range of the longest straight part, where it is another one.

    None where least squares through all readings has that stiffness within a tenth,
    where a range was chosen, and of repeated cycles and several runs, whose stiffness
    is that of all their branches.

    Args:
        case: records with their screening.
    """
    found = case.screening
    part = None if found is None else found.straight
    if found is None or part is None or part.whole or found.working_range:
        return None
    if case.records.known & {"cycles", "run", "specimen"}:
        return None
    slope = np.polyfit(case.records.deformation, case.records.force, 1)[0]
    if abs(slope - part.slope) <= LEAST_DIFFERENCE * abs(part.slope):
        return None
    return f"{part.low!r}:{part.high!r}"


def straight_check(case: Case) -> Check:
    """Fail the one stiffness of a curve that has another one over its straight part.

    Args:
        case: records with their screening.
    """
    name, wanted = "the curve has one stiffness", straight_range(case)
    if wanted is None or case.screening is None or case.screening.straight is None:
        return Check(name, "passed", "no straight part has another one")
    part = case.screening.straight
    words = (
        f"the curve is no straight line: its longest straight part, {part.low:.4g} to "
        f"{part.high:.4g} mm, has {part.slope:.4g} N/mm. Choose it by the range "
        f"{part.low:.6g}:{part.high:.6g}, or all of the curve by the range all"
    )
    return Check(name, "failed", words)
