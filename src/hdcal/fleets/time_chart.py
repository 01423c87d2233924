"""A fleet over time: control charts, and the cumulative sums of the stiffness.

Source:
    Montgomery, Introduction to Statistical Quality Control, 8th ed. (2019): limits at
    three standard deviations, from moving
    ranges; tabular cumulative sums with k = ½ and h = 5.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.fleets.change_points import middle_sd
from hdcal.fleets.over_time import TimeSeries
from hdcal.quantities import Quantities
from hdcal.report.chart import COLOURS, Chart, Series

_LIMIT = 3.0
# What a cumulative sum forgives at each value, and what it may reach, in sds.
_FORGIVEN, _REACH = 0.5, 5.0
_TITLES = {
    "stiffness": "stiffness [%]",
    "zero": "zero [{N}]",
    "noise": "noise [%]",
}


def time_charts(series: Sequence[TimeSeries], units: Quantities) -> list[Chart]:
    """Return a control chart of each quantity, then the sums of the stiffness."""
    sums = [_sums(one) for one in series if one.what == "stiffness"]
    return [*(_control(one, units) for one in series), *sums]


def _control(series: TimeSeries, units: Quantities) -> Chart:
    unit = "%" if series.unit == "percent" else units.load_unit
    place, limit = _place(series), _LIMIT * _sd(series)
    lines = [
        Series(f"{words} [{unit}]", place, np.full(len(place), y), "", dashed=True)
        for words, y in (("upper limit", limit), ("lower limit", -limit))
    ]
    kinds = (
        (series.what, ~series.apart, COLOURS[0]),
        ("far from its neighbours", series.apart, COLOURS[1]),
    )
    points = [
        Series(f"{words} [{unit}]", place[rows], series.value[rows], hue, points=True)
        for words, rows, hue in kinds
        if rows.any()
    ]
    axis = _axis(series), units.say(_TITLES[series.what])
    return _chart(*axis, [*lines, *points], series)


def _sums(series: TimeSeries) -> Chart:
    """Return the tabular cumulative sums, in which a small shift shows early."""
    standard = np.where(series.apart, 0.0, series.value) / _sd(series)
    place = _place(series)
    up, down = np.zeros((2, len(standard)))
    above = below = 0.0
    for row, one in enumerate(standard):
        above = up[row] = max(0.0, above + one - _FORGIVEN)
        below = down[row] = min(0.0, below + one + _FORGIVEN)
    lines = [
        Series(words, place, values, hue, dashed=dashed)
        for words, values, hue, dashed in (
            ("sum of stiffer ones [sd]", up, COLOURS[0], False),
            ("sum of softer ones [sd]", down, COLOURS[1], False),
            ("upper limit [sd]", np.full(len(place), _REACH), "", True),
            ("lower limit [sd]", np.full(len(place), -_REACH), "", True),
        )
    ]
    axis = _axis(series), "sums [sd]"
    return _chart(*axis, lines, series)


def _chart(x: str, y: str, curves: list[Series], series: TimeSeries) -> Chart:
    marked = (np.flatnonzero(series.apart) + 1).tolist()
    return Chart(x, y, curves, height=260, names=[*_names(series)], marked=marked)


def _axis(series: TimeSeries) -> str:
    # Charts of one axis are zoomed together: those of gears, not those of days.
    how = "day by day" if series.what == "zero" else "in order of measurement"
    return f"date and gear, {how}"


def _place(series: TimeSeries) -> np.ndarray:
    return np.arange(1.0, len(series.value) + 1.0)


def _sd(series: TimeSeries) -> float:
    """Return the sd of values by the ranges from one to the next, blind to steps."""
    return middle_sd(np.diff(series.value[~series.apart])) / np.sqrt(2.0) or 1.0


def _names(series: TimeSeries) -> Iterator[str]:
    """Yield what stands at each place: month, day and gear or mounting."""
    for day, name in zip(series.day, series.name, strict=True):
        # The year stands beside the picture.
        yield f"{str(day)[5:]} {name}"
