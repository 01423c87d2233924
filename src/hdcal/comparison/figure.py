"""The figure of a comparison."""

from matplotlib.figure import Figure

from hdcal.comparison.chart import comparison_chart
from hdcal.comparison.compare import Comparison
from hdcal.report.canvas import heading, style
from hdcal.report.chart_figure import draw_chart


def comparison_figure(found: Comparison) -> Figure:
    """Draw the stiffness of every result with its interval."""
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = draw_chart(comparison_chart(found), figure.add_subplot())
        heading(axes, "every result with its 95 % interval")
    return figure
