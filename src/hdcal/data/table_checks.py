"""What readings can be, whatever the rig: checks of whole columns."""

import numpy as np

from hdcal.data.cells import Values
from hdcal.data.columns import Column
from hdcal.data.layout import LISTED, Layout, and_more
from hdcal.errors import Finding

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


def check_values(
    values: Values,
    used: dict[str, Column],
    layout: Layout,
    file: str,
    *,
    fewest: int = FEWEST_ROWS,
) -> list[Finding]:
    """Findings about what single columns cannot be, whatever the rig.

    Args:
        values: by quantity, in code units, NaN where a cell was no number.
        used: columns by quantity.
        layout: of the table.
        file: how the user named the file.
        fewest: rows that are needed.
    """
    findings = []
    if layout.data_rows < fewest:
        words = f"holds {layout.data_rows} rows of readings"
        remedy = f"At least {fewest} are needed"
        findings.append(Finding(file, words, remedy))
    for quantity, limit in _LIMITS.items():
        if quantity not in values:
            continue
        number, header = values[quantity], used[quantity].header
        # not `abs(number) > limit` alone: a NaN was reported where it stands
        wild = np.abs(number) > limit
        words = f"is beyond any {quantity} that a rig can see"
        findings += _rows(
            wild, words, "Check the number and its unit", header, layout, file
        )
        if quantity == "temperature":
            words = "is below absolute zero"
            cold = (number < ABSOLUTE_ZERO - 1e-9) & ~wild
            findings += _rows(cold, words, "Check the unit", header, layout, file)
        if quantity == "force_sd":
            words = "a standard deviation cannot be negative"
            remedy = "Write its size, or 0 when it is not known"
            findings += _rows(number < 0, words, remedy, header, layout, file)
    if "deformation" in values:
        known = values["deformation"][np.isfinite(values["deformation"])]
        if known.size > 1 and known.min() == known.max():
            words = "the deformation is constant, so no stiffness can be seen"
            header = used["deformation"].header
            findings.append(Finding(file, words, "Measure at several", None, header))
    return findings


def check_time(
    time: np.ndarray, run: np.ndarray, column: Column, layout: Layout, file: str
) -> list[Finding]:
    """Findings for each row whose time is before that of its run's last row."""
    order = np.flatnonzero(np.isfinite(time))
    order = order[np.argsort(run[order], kind="stable")]
    back = (np.diff(time[order]) < 0) & (np.diff(run[order]) == 0)
    mask = np.zeros(len(time), bool)
    mask[order[1:][back]] = True
    words = "the time goes back within a run"
    remedy = "Keep the order of taking; label runs in a column 'run' if it restarts"
    return _rows(mask, words, remedy, column.header, layout, file)


def _rows(
    mask: np.ndarray, words: str, remedy: str, header: str, layout: Layout, file: str
) -> list[Finding]:
    where = np.flatnonzero(mask)
    findings = [
        Finding(file, words, remedy, int(layout.rows[index]), header)
        for index in where[:LISTED]
    ]
    return findings + and_more(len(where), "rows like these", file, header)
