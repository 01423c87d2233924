"""Last checks of a stiffness: a robust straight line, and the straight part.

Whether the model has a discrepancy or correlated noise is decided in
`hdcal.inference.force_model.structure`.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.screening.result import (
    LEAST_DIFFERENCE,
    MACHINE_CLASS,
    NORMAL_95,
    StraightPart,
)
from hdcal.screening.turning_points import MEDIAN_SIZE

if TYPE_CHECKING:
    from hdcal.inference.checks import Check

# Largest number of rows of a fit; of more rows every second, third, … is used.
_MOST_ROWS = 20_000


class RobustLine(NamedTuple):
    """A slope with the half-width of its 95 % confidence interval [N/mm]."""

    slope: float
    half_width: float


def robust_line(records: Records) -> RobustLine | None:
    """Return the slope of the readings, as read; None where nothing was deformed.

    Zeros of runs and a linear dependence on temperature are fitted too. The loss is
    Huber's, smooth (`soft_l1`): outliers count little.
    """
    from scipy.optimize import least_squares

    rows = slice(None, None, -(-len(records.force) // _MOST_ROWS))
    run = np.asarray(records.run)[rows]
    deformation, rise, force = (
        less_run_means(np.asarray(values, float)[rows], run)
        for values in (records.deformation, records.temperature, records.force)
    )
    span = float(np.ptp(deformation))
    if span == 0.0:
        return None
    columns = [deformation / span]
    if np.ptp(rise) > 0.0:
        columns += [rise / np.ptp(rise), columns[0] * rise / np.ptp(rise)]
    design = np.column_stack([*columns, np.ones(len(force))])
    start = np.linalg.lstsq(design, force, rcond=None)[0]
    size = float(np.median(np.abs(force - design @ start))) / MEDIAN_SIZE
    size = max(size, 1e-9 * float(np.ptp(force)), 1e-300)
    # The problem is linear: SciPy's own differences find its slopes exactly.
    found = least_squares(
        lambda at: (design @ at - force) / size, start, loss="soft_l1"
    )
    residual = force - design @ found.x
    free = max(len(force) - design.shape[1] - len(np.unique(run)) + 1, 1)
    # The loss weights a residual r by (1 + r²)^(−½).
    weight = (1.0 + (residual / size) ** 2) ** -0.5
    spread = np.sum(weight * residual**2) / free
    inverse = np.linalg.pinv(design.T @ (weight[:, None] * design))
    half = NORMAL_95 * float(np.sqrt(spread * inverse[0, 0]))
    return RobustLine(float(found.x[0]) / span, half / span)


def line_check(records: Records, stiffness: np.ndarray, *, sized: bool) -> "Check":
    """Fail a stiffness that is far from a robust straight line without a reason.

    Also that of a part without sizes where the readings do not determine its sign. The
    draws of the stiffness as read [N/mm] are of a model without effects.
    """
    from hdcal.inference.checks import Check

    name, line = "the stiffness is that of a straight line", robust_line(records)
    if line is None:
        return Check(name, "note", "no slope: the {displacement} is constant")
    low, middle, high = np.quantile(stiffness, [0.025, 0.5, 0.975])
    difference = abs(middle - line.slope)
    is_near = difference <= max(
        (high - low) / 2.0 + line.half_width, LEAST_DIFFERENCE * abs(line.slope)
    )
    words = (
        f"the model gives {middle:.4g} {{N/mm}} ({low:.4g} to {high:.4g}), a "
        f"robust straight line through the same readings {line.slope:.4g} ± "
        f"{line.half_width:.2g} {{N/mm}}"
    )
    if is_near and (sized or line.slope > line.half_width):
        return Check(name, "passed", words)
    remedy = "Check the readings with `hdcal check`; choose a range of them"
    return Check(name, "failed", f"{words}. {remedy}")


def takes_straight_part(case: Case) -> bool:
    """Return whether the stiffness of a curve is that of its straight part.

    It is not where that part has the stiffness of a straight line through all readings.
    """
    found, part, x = case.screening, _part(case), np.asarray(case.records.deformation)
    if found is None or found.working_range or part is None or not np.ptp(x):
        return False
    slope = float(np.polyfit(x, case.records.force, 1)[0])
    return abs(slope - part.slope) > _tolerance(part, MACHINE_CLASS)


def straight_check(case: Case, stiffness: np.ndarray) -> "Check":
    """Fail the one stiffness of a curve that has another one over its straight part.

    The draws of the stiffness as read [N/mm] are of a model without effects.
    """
    from hdcal.inference.checks import Check

    name, part = "the curve has one stiffness", _part(case)
    middle = float(np.median(stiffness))
    if part is None or abs(middle - part.slope) <= _tolerance(part, LEAST_DIFFERENCE):
        return Check(name, "passed", "no straight part has a different stiffness")
    units = case.units
    ends = f"{part.low:.4g} to {part.high:.4g} {units.displacement_unit}"
    words = (
        f"the curve is not straight: its longest straight part, {ends}, has "
        f"{part.slope:.4g} {units.stiffness_unit}, but the model {middle:.4g}. State "
        "a range: straight (the longest straight part), the ends of another part, or "
        "all (the whole curve)"
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


def _tolerance(part: StraightPart, share: float) -> float:
    """Return the difference from a part's stiffness that counts [N/mm]."""
    return max(NORMAL_95 * part.slope_sd, share * abs(part.slope))
