"""A chart drawn by matplotlib, for whoever composes figures of their own."""

from matplotlib.axes import Axes

from hdcal.report.chart import Chart

_INK = "#222222"


def draw_chart(chart: Chart, axes: Axes | None = None) -> Axes:
    """Draw a chart, and return where.

    Args:
        chart: what to draw.
        axes: where; by default new ones of pyplot's.
    """
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots()[1]
    for high, low, strength in chart.bands:
        top, bottom = chart.series[high], chart.series[low]
        look = {"color": top.colour, "alpha": strength, "linewidth": 0.0}
        label = top.label.rpartition(",")[0] or top.label
        axes.fill_between(top.x, bottom.y, top.y, label=label, **look)
    for series in chart.series:
        colour = series.colour or _INK
        if series.points:
            axes.plot(
                series.x, series.y, ".", color=colour, label=series.label, zorder=4
            )
        elif series.width:
            line = ":" if series.dashed else "-"
            axes.plot(series.x, series.y, line, color=colour, label=series.label)
    axes.set_xlabel(chart.x)
    axes.set_ylabel(chart.y)
    axes.legend(fontsize="small")
    return axes
