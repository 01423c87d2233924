"""The force of gears to come as a chart: the next one, and what many of them keep."""

from collections.abc import Sequence

import numpy as np

from hdcal.fleets.next_force import ForceBounds, NextForce
from hdcal.report.axes import load_axis
from hdcal.report.chart import COLOURS, Chart, Series, interval_boxes

# What a band is called, and its ends.
_ENDS = "interval and bounds, at most", "interval and bounds, at least"


def bound_rows(found: NextForce) -> Sequence[ForceBounds]:
    """Return the bounds that are told, its table."""
    return found.bounds


def force_chart(found: NextForce) -> Chart:
    """Return the interval of the next gear, bounds of many, and the capacity."""
    each = [(found.force_N.lo, found.force_N.hi)]
    each += [(one.at_least_N, one.at_most_N) for one in found.bounds]
    low, high = np.array(each).T
    place, units = np.arange(1.0, len(each) + 1.0), found.units
    at = f"{found.deformation_mm:g} {units.displacement_unit}"
    series = interval_boxes(place, low, high, _ENDS, units.load_unit)
    middle = np.array([found.force_N.median])
    series.append(
        Series(load_axis(units, "the next gear"), place[:1], middle, COLOURS[0], True)
    )
    if found.limit_force_N is not None:
        limit = np.full(2, found.limit_force_N)
        ends = np.array([0.5, len(each) + 0.5])
        series.append(
            Series(load_axis(units, "capacity"), ends, limit, COLOURS[1], dashed=True)
        )
    # As people write content and confidence: 99/95.
    pairs = [(100.0 * one.content, 100.0 * one.confidence) for one in found.bounds]
    names = ["next gear", *(f"{many:.6g}/{sure:.6g}" for many, sure in pairs)]
    axis = "gears to come", load_axis(units, f"{units.load} at {at}")
    return Chart(*axis, series, [(0, 1, 0.25)], names=names)
