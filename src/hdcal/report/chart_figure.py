"""A chart drawn by matplotlib, for whoever composes figures of their own."""

from matplotlib.axes import Axes

from hdcal.report.canvas import plain
from hdcal.report.chart import Chart
from hdcal.report.chart_drawing import draw_panel
from hdcal.report.chart_spec import Chart as ChartSpec

_INK = "#222222"
# A legend of more lines hides what it explains.
_MOST_NAMED, _LONGEST = 8, 40
# More names, and longer ones, leave an axis no room.
_MOST_PLACES, _LONGEST_PLACE = 60, 16
# Letters that stand beside each other below an axis.
_LEVEL = 60


def draw_chart(chart: Chart | ChartSpec, axes: Axes | None = None) -> Axes:
    """Draw a chart, and return where.

    Args:
        chart: what to draw.
        axes: where; by default new ones of pyplot's.
    """
    axes = axes_or_new(axes)
    if isinstance(chart, ChartSpec):
        return draw_panel(chart.panels[0], axes)
    for high, low, strength in chart.bands:
        top, bottom = chart.series[high], chart.series[low]
        look = {"color": top.colour, "alpha": strength, "linewidth": 0.0}
        label = plain(top.label.rpartition(",")[0] or top.label, _LONGEST)
        axes.fill_between(top.x, bottom.y, top.y, label=label, **look)
    for series in chart.series:
        colour, label = series.colour or _INK, plain(series.label, _LONGEST)
        if series.points:
            axes.plot(series.x, series.y, ".", color=colour, label=label, zorder=4)
        elif series.width:
            line = ":" if series.dashed else "-"
            axes.plot(series.x, series.y, line, color=colour, label=label)
    axes.set_xlabel(chart.x)
    if chart.names:
        _name_places(chart, axes)
    axes.set_ylabel(chart.y)
    least, most = chart.limits
    bottom, top = axes.get_ylim()
    axes.set_ylim(
        bottom if least is None else max(bottom, least),
        top if most is None else min(top, most),
    )
    if len(axes.get_legend_handles_labels()[1]) <= _MOST_NAMED:
        axes.legend(fontsize="small")
    return axes


def _name_places(chart: Chart, axes: Axes) -> None:
    """Name the places of an axis: all of them, or those that are marked."""
    every = range(1, len(chart.names) + 1)
    places = [*(every if len(every) <= _MOST_PLACES else chart.marked)][:_MOST_PLACES]
    names = [plain(chart.names[place - 1], _LONGEST_PLACE) for place in places]
    if names:
        axes.set_xticks(places, names)
    if len(names) * max(map(len, names), default=0) > _LEVEL:
        axes.tick_params(axis="x", labelrotation=90, labelsize=7)


def axes_or_new(axes: Axes | None) -> Axes:
    """Return these axes, or new ones of pyplot's."""
    if axes is None:
        from matplotlib import pyplot

        return pyplot.subplots(layout="constrained")[1]
    return axes
