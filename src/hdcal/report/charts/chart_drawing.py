"""Matplotlib's drawing of a chart: axes, SVG and PNG."""

from collections.abc import Callable, Sequence
from textwrap import wrap
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple

from hdcal.report.charts.canvas import heading, plain, render, style, watermark
from hdcal.report.charts.chart_spec import (
    Band,
    Bars,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
    Span,
    drawn_rows,
)

Kind = Literal["svg", "png"]
_DARK = "#222222"
_DASHES = {"solid": "-", "dashed": (0, (4, 2)), "dotted": ":", "dashdot": "-."}
_WIDTH = 7.6
# More points than this are drawn small, and as pixels in an SVG.
_MANY = 300
# More names, or longer ones, leave an axis no room.
_MOST_NAMES, _LONGEST_NAME, _LEVEL = 60, 26, 70
# Names beside a bar are written in lines.
_LINE, _LONGEST_LINES = 40, 110
_MOST_LEGENDS, _LONGEST_LEGEND = 12, 60


def images(
    chart: Chart, title: str = "", kinds: Sequence[Kind] = ("svg", "png")
) -> dict[Kind, bytes]:
    """Return a chart as the bytes of files, by their kinds."""
    figure = draw(chart)
    return {kind: render(figure, kind, title) for kind in kinds}


def draw(chart: Chart) -> Figure:
    """Return a chart as a figure."""
    places, heights = _places(chart)
    with style():
        figure = Figure(figsize=(_WIDTH, sum(heights)), layout="constrained")
        grid = figure.add_gridspec(len(heights), chart.columns, height_ratios=heights)
        first: Axes | None = None
        named: set[str] = set()
        for panel, (row, column) in zip(chart.panels, places, strict=True):
            cell = grid[row, :] if panel.wide else grid[row, column]
            shared: dict[str, Any] = {}
            if not panel.wide:
                shared = {
                    "sharex": first if chart.share_x else None,
                    "sharey": first if chart.share_y else None,
                }
            axes = figure.add_subplot(cell, **shared)
            draw_panel(panel, axes, named)
            if not panel.wide:
                first = first or axes
                if chart.columns > 1 and not (panel.names or panel.x_log):
                    axes.locator_params(axis="x", nbins=5)
                if chart.share_y and column:
                    axes.tick_params(labelleft=False)
                    axes.set_ylabel("")
        if chart.share_x and chart.columns > 1:
            # Side by side there is no room for the same label again.
            for axes in figure.axes:
                axes.set_xlabel("")
            figure.supxlabel(plain(chart.panels[-1].x), fontsize=10)
        if chart.failed:
            watermark(figure)
    return figure


def _places(chart: Chart) -> tuple[list[tuple[int, int]], list[float]]:
    """Return row and column of each panel, and the height of each row."""
    places: list[tuple[int, int]] = []
    heights: list[float] = []
    column = 0
    for panel in chart.panels:
        if panel.wide or column in (0, chart.columns):
            heights.append(0.0)
            column = 0
        places.append((len(heights) - 1, column))
        heights[-1] = max(heights[-1], panel.height or _height(panel, chart))
        column = chart.columns if panel.wide else column + 1
    return places, heights


def _height(panel: Panel, chart: Chart) -> float:
    if panel.horizontal:
        return 1.1 + 0.3 * max(len(panel.names), 2)
    if panel.wide or len(chart.panels) == 1:
        return 4.4
    return 2.6 if chart.columns == 1 else 2.1


def draw_panel(panel: Panel, axes: Axes, named: set[str] | None = None) -> Axes:
    """Draw the marks of a panel.

    Args:
        panel: what to draw.
        axes: where.
        named: labels that a legend beside it holds already; those of this panel are
            added.

    Returns:
        The axes.
    """
    named = set() if named is None else named
    entries: dict[str, list[Any]] = {}
    for order, mark in enumerate(panel.marks):
        handle = _DRAWERS[type(mark)](axes, mark, panel.horizontal, 2.0 + 0.01 * order)
        if mark.label:
            handles = handle if isinstance(handle, list) else [handle]
            entries.setdefault(mark.label, []).extend(handles)
    x, y = ("y", "x") if panel.horizontal else ("x", "y")
    for axis, label, limits, log in (
        (x, panel.x, panel.x_limits, panel.x_log),
        (y, panel.y, panel.y_limits, panel.y_log),
    ):
        axes.set(**{f"{axis}label": plain(label)})
        if log:
            axes.set(**{f"{axis}scale": "log"})
        if limits != (None, None):
            axes.set(**{f"{axis}lim": limits})
    if panel.names:
        _name(axes, panel)
    if not panel.y_ticks:
        axes.set_yticks([])
        axes.grid(False)
        axes.spines["left"].set_visible(False)
    if panel.title:
        heading(axes, plain(panel.title))
    entries = {name: each for name, each in entries.items() if name not in named}
    named |= set(entries)
    if 0 < len(entries) <= _MOST_LEGENDS:
        handles = [tuple(each) for each in entries.values()]
        names = [plain(name, _LONGEST_LEGEND) for name in entries]
        look: dict[str, Any] = {"frameon": True, "framealpha": 0.8, "edgecolor": "none"}
        combined = {tuple: HandlerTuple(ndivide=1)}
        place: dict[str, Any] = {"loc": "best"}
        if panel.legend_beside:
            place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
        axes.legend(handles, names, handler_map=combined, **place, **look)
    return axes


def axes_or_new(axes: Axes | None) -> Axes:
    """Return these axes, or new ones of pyplot."""
    if axes is None:
        from matplotlib import pyplot

        return pyplot.subplots(layout="constrained")[1]
    return axes


def _name(axes: Axes, panel: Panel) -> None:
    """Write categories in place of numbers; of very many only some have room."""
    step = -(-len(panel.names) // _MOST_NAMES)
    at = range(1, len(panel.names) + 1, step)
    names = [plain(name, _LONGEST_NAME) for name in panel.names[::step]]
    if panel.horizontal:
        lines = [wrap(plain(name, _LONGEST_LINES), _LINE) for name in panel.names]
        axes.set_yticks(at, ["\n".join(each) for each in lines[::step]])
        axes.set_ylim(len(panel.names) + 0.6, 0.4)
        axes.grid(False, axis="y")
        return
    axes.set_xticks(at, names)
    axes.set_xlim(0.4, len(panel.names) + 0.6)
    axes.grid(False, axis="x")
    if len(names) * max(map(len, names)) > _LEVEL:
        axes.tick_params(axis="x", labelrotation=90, labelsize=7)


def _line(axes: Axes, mark: Line, turned: bool, order: float) -> Any:
    look = {
        "color": mark.colour or _DARK,
        "linestyle": _DASHES[mark.dash],
        "linewidth": mark.width,
        "zorder": order,
    }
    if mark.steps:
        way = "horizontal" if turned else "vertical"
        return axes.stairs(mark.y, mark.x, baseline=None, orientation=way, **look)
    pair = (mark.y, mark.x) if turned else (mark.x, mark.y)
    return axes.plot(*pair, **look)[0]


def _points(axes: Axes, mark: Points, turned: bool, order: float) -> Any:
    rows = drawn_rows(mark.y)
    many = len(rows) > _MANY
    x, y = mark.x[rows], mark.y[rows]
    pair = (y, x) if turned else (x, y)
    colour = mark.colour or _DARK
    if mark.low is not None and mark.high is not None:
        reach = np.abs(np.stack([y - mark.low[rows], mark.high[rows] - y]))
        bars: dict[str, Any] = {"xerr" if turned else "yerr": reach}
        bars |= {"ecolor": colour, "elinewidth": 1.6, "capsize": 3, "zorder": order}
        axes.errorbar(*pair, fmt="none", **bars)
    return axes.plot(
        *pair,
        mark.marker,
        color=colour,
        markersize=2.5 if many else 5.0,
        markeredgecolor="none" if many else "white",
        markeredgewidth=0.5,
        alpha=0.5 if many else 1.0,
        rasterized=many,
        zorder=order,
    )[0]


def _band(axes: Axes, mark: Band, turned: bool, order: float) -> Any:
    fill = axes.fill_betweenx if turned else axes.fill_between
    ends = mark.x, mark.low, mark.high
    shade = {"color": mark.colour, "linewidth": 0.0, "zorder": order}
    found = [fill(*ends, alpha=mark.opacity, **shade)]
    if mark.hatched:
        # By itself: in an SVG the opacity of an area is that of its hatching too.
        edge = {"facecolor": "none", "edgecolor": mark.colour, "linewidth": 0.0}
        found.append(fill(*ends, hatch="////", alpha=0.45, zorder=order, **edge))
    return found


def _bars(axes: Axes, mark: Bars, turned: bool, order: float) -> Any:
    low = np.zeros(len(mark.at)) if mark.low is None else mark.low
    look = {"color": mark.colour or _DARK, "zorder": order}
    if mark.hatched:
        look |= {"hatch": "////", "edgecolor": "white", "linewidth": 0.0}
    if turned:
        return axes.barh(mark.at, mark.high - low, mark.width, left=low, **look)
    return axes.bar(mark.at, mark.high - low, mark.width, bottom=low, **look)


def _is_upright(axis: str, turned: bool) -> bool:
    """Tell whether a value of this axis is a place from left to right."""
    return (axis == "x") != turned


def _rule(axes: Axes, mark: Rule, turned: bool, order: float) -> Any:
    draw = axes.axvline if _is_upright(mark.axis, turned) else axes.axhline
    look = {"linestyle": _DASHES[mark.dash], "linewidth": 1.1, "zorder": order}
    return draw(mark.at, color=mark.colour or _DARK, **look)


def _span(axes: Axes, mark: Span, turned: bool, order: float) -> Any:
    draw = axes.axvspan if _is_upright(mark.axis, turned) else axes.axhspan
    look = {"color": mark.colour, "alpha": mark.opacity, "linewidth": 0.0}
    return draw(mark.low, mark.high, zorder=order, **look)


_DRAWERS: dict[type[Mark], Callable[[Axes, Any, bool, float], Any]] = {
    Line: _line,
    Points: _points,
    Band: _band,
    Bars: _bars,
    Rule: _rule,
    Span: _span,
}
