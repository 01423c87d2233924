"""The figures of a fleet."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.fleets.chart import fleet_chart
from hdcal.fleets.curves import curve, shown_gears
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.over_time import TimeSeries
from hdcal.fleets.time_chart import time_charts
from hdcal.quantities import Quantities
from hdcal.report.axes import displacement_axis, load_axis
from hdcal.report.canvas import FAILED, heading, plain, style
from hdcal.report.chart import COLOURS
from hdcal.report.chart_figure import draw_chart

_GREY, _LONGEST = "#808080", 40
# The first of the colours is that of ordinary gears elsewhere.
_HUES = (*COLOURS[1:], COLOURS[0])


def fleet_figure(found: Fleet) -> Figure:
    """Draw the stiffness of every gear with its interval."""
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = draw_chart(fleet_chart(found), figure.add_subplot())
        _head(axes, found, "every gear with its 95 % interval")
    return figure


def curves_figure(found: Fleet) -> Figure:
    """Draw the readings: ordinary gears in grey, those called off in colours."""
    shown = shown_gears(found)
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = figure.add_subplot()
        look: dict[str, Any] = {"color": _GREY, "linewidth": 0.6, "alpha": 0.6}
        axes.plot(*curve(found, shown.ordinary), label="ordinary gears", **look)
        for gear, hue in zip(shown.called, _HUES, strict=False):
            name = plain(found.case.specimen_labels[gear], _LONGEST)
            axes.plot(*curve(found, gear), color=hue, linewidth=1.2, label=name)
        units = found.case.units
        axes.set_xlabel(displacement_axis(found.case))
        axes.set_ylabel(load_axis(units, f"{units.load} as read"))
        axes.legend(fontsize="small")
        _head(axes, found, f"the readings, {units.load} over {units.displacement}")
    return figure


def _head(axes: Axes, found: Fleet, words: str) -> None:
    what = FAILED if found.reasons else words
    heading(axes, f"{plain(found.case.name, _LONGEST)}: {what}")


def time_figure(series: Sequence[TimeSeries], units: Quantities) -> Figure:
    """Draw the control charts of a fleet, one above the other.

    Args:
        series: one at least.
        units: of what was measured.
    """
    charts = time_charts(series, units)
    with style():
        figure = Figure(figsize=(7.6, 3.0 * len(charts)), layout="constrained")
        for place, chart in enumerate(charts, 1):
            draw_chart(chart, figure.add_subplot(len(charts), 1, place))
    return figure
