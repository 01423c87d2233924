"""What readings can be, whatever the rig: checks of whole columns."""

import numpy as np

from hdcal.data.columns import Columns
from hdcal.data.plausible import RANGES
from hdcal.data.units import COLUMN_UNITS

FEWEST_ROWS = 5
# Kelvin become degrees Celsius with an error of rounding.
_ROUNDED = 1e-9


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
    for quantity in filter(values.__contains__, COLUMN_UNITS):
        number, known = values[quantity], RANGES[quantity]
        slack = _ROUNDED if quantity == "temperature" else 0.0
        # a NaN was reported where it stands
        wild = (number < known.low - slack) | (number > known.high)
        columns.find(wild, quantity, known.problem(), "Check the number and its unit")
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
    # A wild number may overflow here; it has a finding of its own.
    with np.errstate(over="ignore"):
        back = (np.diff(time[order]) < 0) & (np.diff(run[order]) == 0)
    mask = np.zeros(len(time), bool)
    mask[order[1:][back]] = True
    words = "the time goes back within a run"
    remedy = "Keep the order of taking; label runs in a column 'run' if it restarts"
    columns.find(mask, "time", words, remedy)
