"""The figures of a fleet."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from hdcal.fleets.chart import fleet_chart
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.over_time import TimeSeries
from hdcal.fleets.time_chart import time_charts
from hdcal.report.canvas import FAILED, heading, plain, style
from hdcal.report.chart_figure import draw_chart


def fleet_figure(found: Fleet) -> Figure:
    """Draw the stiffness of every gear with its interval."""
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = draw_chart(fleet_chart(found), figure.add_subplot())
        what = FAILED if found.reasons else "every gear with its 95 % interval"
        heading(axes, f"{plain(found.case.name, 40)}: {what}")
    return figure


def time_figure(series: Sequence[TimeSeries]) -> Figure:
    """Draw the control charts of a fleet, one above the other.

    Args:
        series: one at least.
    """
    charts = time_charts(series)
    with style():
        figure = Figure(figsize=(7.6, 3.0 * len(charts)), layout="constrained")
        for place, chart in enumerate(charts, 1):
            draw_chart(chart, figure.add_subplot(len(charts), 1, place))
    return figure
