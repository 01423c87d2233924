"""The figure of the force of gears to come."""

from matplotlib.figure import Figure

from hdcal.fleets.force.chart import force_chart
from hdcal.fleets.next_force import NextForce
from hdcal.report.canvas import heading, plain, style
from hdcal.report.chart_figure import draw_chart


def force_figure(found: NextForce, name: str) -> Figure:
    """Draw the interval of the next gear, and the bounds that many keep.

    Args:
        found: the force.
        name: of the fleet.
    """
    with style():
        figure = Figure(figsize=(7.6, 4.0), layout="constrained")
        axes = draw_chart(force_chart(found), figure.add_subplot())
        heading(axes, f"{plain(name, 40)}: {found.units.load} of gears to come")
    return figure
