"""Checks of readings, whatever the rig."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.case import Gear
from hdcal.data.findings import FileFindings
from hdcal.data.plausible import RANGES
from hdcal.data.tables.columns import Column
from hdcal.data.tables.headers import DIMENSIONS

FEWEST_ROWS = 5
_ROUNDED = 1e-9  # kelvin become degrees Celsius with an error of rounding


def check_whole(
    frame: pd.DataFrame,
    used: Mapping[str, Column],
    findings: FileFindings,
    fewest: int = FEWEST_ROWS,
) -> None:
    """Find too few rows in a source, and a deformation that is constant."""
    if len(frame) < fewest:
        words = f"contains {len(frame)} rows of readings"
        findings.add(words, f"At least {fewest} are needed")
    if "deformation" in frame and is_constant(frame["deformation"].to_numpy()):
        column = used["deformation"]
        words = f"the {column.quantity} is constant, which gives no stiffness"
        remedy = f"Measure at several {column.quantity}s"
        findings.add(words, remedy, None, column.header)


def is_constant(deformation: np.ndarray) -> bool:
    """Tell whether a deformation never changes."""
    known = deformation[np.isfinite(deformation)]
    return known.size > 1 and known.min() == known.max()


def check_rows(
    frame: pd.DataFrame, used: Mapping[str, Column], findings: FileFindings
) -> None:
    """Find numbers that no rig reads."""
    for quantity in filter(frame.columns.__contains__, DIMENSIONS):
        column, values = used[quantity], frame[quantity].to_numpy()
        known = RANGES[column.quantity]
        slack = _ROUNDED if quantity == "temperature" else 0.0
        wild = (values < known.low - slack) | (values > known.high)
        words = known.problem(), "Check the number and its unit"
        rows = frame.index[wild].tolist()
        findings.add_rows(((row, *words) for row in rows), column.header)


def check_reach(
    frame: pd.DataFrame, column: Column, gear: Gear, findings: FileFindings
) -> None:
    """Find deformations that no gear of this radius reaches."""
    size: Any = frame["deformation"].abs()
    beyond = size[(size >= gear.reach) & ~size.index.isin([*findings.rows])]
    radius = f"a radius of {gear.geometry.radius:g} mm"
    remedy = "Check the unit of the column and the radius in the gear file"
    faults = (
        (int(row), f"a deformation of '{far:g} mm' is impossible at {radius}", remedy)
        for row, far in beyond.items()
    )
    findings.add_rows(faults, column.header)


def rows_back_in_time(time: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Tell which rows have a time before that of their run's last row, shape (n,)."""
    order = np.flatnonzero(np.isfinite(time))
    order = order[np.argsort(run[order], kind="stable")]
    # A wild number may overflow here; it has another finding.
    with np.errstate(over="ignore"):
        back = (np.diff(time[order]) < 0) & (np.diff(run[order]) == 0)
    faulty = np.zeros(len(time), bool)
    faulty[order[1:][back]] = True
    return faulty
