"""The figure of a check."""

from matplotlib.figure import Figure

from hdcal.calibration.check.chart import case_chart
from hdcal.data.case import Case
from hdcal.report.canvas import heading, plain, style
from hdcal.report.chart_figure import draw_chart


def readings_figure(case: Case) -> Figure:
    """Draw force over deformation, each gear or mounting in its colour."""
    with style():
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        axes = draw_chart(case_chart(case), figure.add_subplot())
        heading(axes, f"{plain(case.name)}: the readings")
    return figure
