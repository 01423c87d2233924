"""Gears that are left out, in the answers and tables that the others are in."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.measurements.bad_gears import cause
from hdcal.report.answer import Words


@dataclass(frozen=True)
class GearLeftOut:
    """A gear that is in none of the numbers, and why."""

    gear: Words
    why: Words


def left_out_of(case: Case) -> tuple[GearLeftOut, ...]:
    """Return the gears that are left out of a case."""
    return tuple(GearLeftOut(gear, cause(why)) for gear, why in case.left_out.items())


def with_left_out(columns: Mapping[str, np.ndarray], case: Case) -> dict:
    """Return the columns of gears.csv with gears that are left out below the others.

    What they lack is NaN among numbers with a point, None elsewhere.

    Args:
        columns: of these, status among them.
        case: of which some are left out.
    """
    left_out = left_out_of(case)
    if not left_out:
        return dict(columns)
    empty = np.full(len(left_out), None, object)
    own = {
        "gear": np.array([one.gear for one in left_out], object),
        "status": np.array([f"left out: {one.why}" for one in left_out], object),
    }
    unknown = np.full(len(left_out), np.nan)
    return {
        name: np.concatenate(
            [column, unknown]
            if column.dtype.kind == "f"
            else [column.astype(object), own.get(name, empty)]
        )
        for name, column in columns.items()
    }
