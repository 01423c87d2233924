"""The figure of what gears have in common."""

from matplotlib.figure import Figure

from hdcal.report.canvas import FAILED, heading, plain, style
from hdcal.report.chart_figure import draw_chart
from hdcal.shared_causes.causes import FleetCauses
from hdcal.shared_causes.chart import causes_chart


def causes_figure(found: FleetCauses) -> Figure:
    """Draw how often each cause is, with its interval."""
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = draw_chart(causes_chart(found), figure.add_subplot())
        what = FAILED if found.reasons else "how often each cause is (95 % intervals)"
        heading(axes, f"{plain(found.case.name, 40)}: {what}")
    return figure
