"""Whether readings scatter at all."""

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.errors import Finding, InputError

# Share of the forces that is no more than rounding of what was computed.
_NOTHING = 1e-8


def require_scatter(case: Case) -> None:
    """Raise InputError for readings on straight lines to the last digit.

    Not where the step of the display or the sd of a row is stated.
    """
    records = case.records
    if case.gear.force_resolution > 0.0 or np.any(np.asarray(records.force_sd) > 0.0):
        return
    force = np.asarray(records.force)
    # Of many gears the first rows alone are at hand, or none of those that are asked.
    if not len(force):
        return
    if np.max(np.abs(left_of_lines(records, force))) > _NOTHING * np.max(np.abs(force)):
        return
    words = "the scatter of the readings cannot be estimated: each run lies exactly on "
    words += "a straight line"
    remedy = "If the readings are rounded, state the step of the display as "
    remedy += "force_resolution_N in [measurement] of the gear file; add noise to "
    remedy += "simulated readings"
    raise InputError([Finding(case.name, words, remedy)])


def left_of_lines(records: Records, values: np.ndarray) -> np.ndarray:
    """Return values, shape (n,), less a line of each specimen, zeros of runs apart."""
    run, specimen = np.asarray(records.run), np.asarray(records.specimen)
    x, y = (
        less_run_means(np.asarray(each), run) for each in (records.deformation, values)
    )
    squares = np.bincount(specimen, x * x)
    slope = np.bincount(specimen, x * y) / np.where(squares > 0.0, squares, 1.0)
    return y - slope[specimen] * x
