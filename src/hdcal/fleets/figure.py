"""The figure of a fleet."""

from matplotlib.figure import Figure

from hdcal.fleets.chart import fleet_chart
from hdcal.fleets.fleet import Fleet
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
