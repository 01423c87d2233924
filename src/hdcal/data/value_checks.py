"""What readings can be, whatever the rig: checks of whole columns."""

import numpy as np

from hdcal.data.columns import Columns

FEWEST_ROWS = 5
ABSOLUTE_ZERO = -273.15

# Beyond these a cell is a slip of the pen or of the unit, and its square would
# leave the range of floating point: mm, N, °C, s, rad.
_LIMITS = {
    "deformation": 1e6,
    "force": 1e12,
    "temperature": 1e4,
    "time": 1e12,
    "angle": 1e9,
    "force_sd": 1e12,
}


def check_values(columns: Columns, fewest: int) -> None:
    """Find what single columns cannot be, whatever the rig.

    Args:
        columns: that are checked; each finding is added to theirs.
        fewest: rows that are needed.
    """
    values, count = columns.values, columns.table.filled
    if count < fewest:
        words = f"holds {count} rows of readings"
        columns.findings.add(words, f"At least {fewest} are needed")
    for quantity, limit in _LIMITS.items():
        if quantity not in values:
            continue
        number = values[quantity]
        # not `abs(number) > limit` alone: a NaN was reported where it stands
        wild = np.abs(number) > limit
        words = f"is beyond any {quantity} that a rig can see"
        columns.find(wild, quantity, words, "Check the number and its unit")
        if quantity == "temperature":
            cold = (number < ABSOLUTE_ZERO - 1e-9) & ~wild
            columns.find(cold, quantity, "is below absolute zero", "Check the unit")
        if quantity == "force_sd":
            words = "a standard deviation cannot be negative"
            remedy = "Write its size, or 0 when it is not known"
            columns.find(number < 0, quantity, words, remedy)
    if "deformation" in values:
        known = values["deformation"][np.isfinite(values["deformation"])]
        if known.size > 1 and known.min() == known.max():
            words = "the deformation is constant, so no stiffness can be seen"
            header = columns.used["deformation"].header
            columns.findings.add(words, "Measure at several", None, header)


def check_time(columns: Columns, run: np.ndarray) -> None:
    """Find each row whose time is before that of its run's last row.

    Args:
        columns: that are checked; each finding is added to theirs.
        run: index of the mounting, shape (n,).
    """
    if "time" not in columns.values:
        return
    time = columns.values["time"]
    order = np.flatnonzero(np.isfinite(time))
    order = order[np.argsort(run[order], kind="stable")]
    back = (np.diff(time[order]) < 0) & (np.diff(run[order]) == 0)
    mask = np.zeros(len(time), bool)
    mask[order[1:][back]] = True
    words = "the time goes back within a run"
    remedy = "Keep the order of taking; label runs in a column 'run' if it restarts"
    columns.find(mask, "time", words, remedy)
