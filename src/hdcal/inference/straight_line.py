"""A robust straight line through the readings, beside which a posterior must stand."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from hdcal.data.records import Records, less_run_means
from hdcal.inference.checks import Check
from hdcal.screening.result import LEAST_DIFFERENCE, NORMAL_95

# So many rows decide a line; of more every second, third, … is taken.
_MOST_ROWS = 20_000
# Residuals of normal noise have their median size at so many sds.
_MEDIAN_SIZE = 0.6745


class RobustLine(NamedTuple):
    """A slope with the half-width of its 95 % confidence interval [N/mm]."""

    slope: float
    half_width: float


def robust_line(records: Records) -> RobustLine | None:
    """Return the slope of the readings, as read; None where nothing was deformed.

    Zeros of runs and a linear dependence on temperature are fitted beside it. The loss
    is Huber's, smooth (`soft_l1`): wild readings count little.

    Args:
        records: the rows.
    """
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
    size = float(np.median(np.abs(force - design @ start))) / _MEDIAN_SIZE
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


def line_check(records: Records, stiffness: np.ndarray, *, sized: bool) -> Check:
    """Fail a stiffness that is far from a robust straight line without a reason.

    And that of a part without sizes, of which only the readings tell the stiffness,
    where they do not tell its sign.

    Args:
        records: the rows.
        stiffness: draws of the stiffness as read [N/mm], of a model without effects.
        sized: whether a theory tells the stiffness from the sizes of the part.
    """
    name, line = "the stiffness is that of a straight line", robust_line(records)
    if line is None:
        return Check(name, "note", "no slope: the {displacement} does not change")
    low, middle, high = np.quantile(stiffness, [0.025, 0.5, 0.975])
    apart = abs(middle - line.slope)
    near = apart <= (high - low) / 2.0 + line.half_width
    near = near or apart <= LEAST_DIFFERENCE * abs(line.slope)
    words = (
        f"the model has {middle:.4g} {{N/mm}} ({low:.4g} to {high:.4g}), a "
        f"robust straight line through the same readings {line.slope:.4g} ± "
        f"{line.half_width:.2g} {{N/mm}}"
    )
    near = near and (sized or line.slope > line.half_width)
    if not near:
        words += ". Look at the readings with `hdcal check`; choose a part of them"
    return Check(name, "passed" if near else "failed", words)
