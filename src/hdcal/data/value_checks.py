"""What readings can be, whatever the rig: checks of whole columns."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.plausible import RANGES
from hdcal.data.tables.headers import DIMENSIONS

if TYPE_CHECKING:
    from hdcal.data.used_columns import Columns

FEWEST_ROWS = 5
# Kelvin become degrees Celsius with an error of rounding.
_ROUNDED = 1e-9


def check_values(columns: "Columns", fewest: int) -> None:
    """Find what single columns cannot be, whatever the rig.

    Args:
        columns: that are checked; each finding is added to theirs.
        fewest: rows that are needed.
    """
    values, count = columns.values, columns.table.filled
    if count < fewest:
        words = f"holds {count} rows of readings"
        columns.findings.add(words, f"At least {fewest} are needed")
    for quantity in filter(values.__contains__, DIMENSIONS):
        used = columns.used[quantity]
        wild = wild_rows(values[quantity], used.quantity, columns.table.rows)
        columns.findings.add_rows(wild, used.header)
    if "deformation" in values:
        known = values["deformation"][np.isfinite(values["deformation"])]
        if known.size > 1 and known.min() == known.max():
            used = columns.used["deformation"]
            words = f"the {used.quantity} is constant, so no stiffness can be seen"
            columns.findings.add(words, "Measure at several", None, used.header)


def wild_rows(
    values: np.ndarray, quantity: str, rows: np.ndarray
) -> Iterator[tuple[int, str, str]]:
    """Yield row, problem and remedy of numbers that no rig reads.

    Args:
        values: in code units, shape (n,); NaN where something else is wrong.
        quantity: one with numbers.
        rows: of the source, shape (n,).
    """
    known = RANGES[quantity]
    slack = _ROUNDED if quantity == "temperature" else 0.0
    wild = (values < known.low - slack) | (values > known.high)
    for row in rows[wild].tolist():
        yield row, known.problem(), "Check the number and its unit"


def rows_back_in_time(time: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Tell which rows have a time before that of their run's last row, shape (n,).

    Args:
        time: of each row, shape (n,); NaN where it is wrong.
        run: index of the mounting, shape (n,).
    """
    order = np.flatnonzero(np.isfinite(time))
    order = order[np.argsort(run[order], kind="stable")]
    # A wild number may overflow here; it has a finding of its own.
    with np.errstate(over="ignore"):
        back = (np.diff(time[order]) < 0) & (np.diff(run[order]) == 0)
    found = np.zeros(len(time), bool)
    found[order[1:][back]] = True
    return found
