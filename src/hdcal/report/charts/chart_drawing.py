"""Drawing of charts by Matplotlib: axes, SVG and PNG."""

import io
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from textwrap import wrap
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.legend_handler import HandlerTuple

from hdcal.errors import printable
from hdcal.report.charts.chart_spec import (
    RED,
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
# Width of a figure [inch], and dots per inch of a PNG.
_WIDTH, _DPI = 7.6, 160
# More points than this are drawn small, and as pixels in an SVG.
_MANY = 300
# Most names of an axis, longest name, and most characters of level names together.
_MOST_NAMES, _LONGEST_NAME, _LEVEL = 60, 26, 70
# Names beside bars: characters in a line and in all.
_LINE, _LONGEST_LINES = 40, 110
_MOST_LEGENDS, _LONGEST_LEGEND = 12, 60
# Fonts for characters that the default font lacks, such as Chinese.
_FONTS = ("Noto Sans CJK SC", "Noto Sans CJK JP", "WenQuanYi Zen Hei", "SimHei")
_STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.formatter.limits": (-5, 7),
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "axes.labelsize": 10,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    # Automatic placement takes a seventh of all drawing.
    "axes.titley": 1.0,
    "figure.facecolor": "white",
    "font.size": 9.5,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.8,
    "hatch.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "hdcal",
    "text.usetex": False,
}


def style():
    """Return a context in which figures are drawn and rendered."""
    return mpl.rc_context({**_STYLE, "font.family": _families()})


@cache
def _families() -> list[str]:
    installed = {font.name for font in fontManager.ttflist}
    return ["DejaVu Sans", *(name for name in _FONTS if name in installed)]


def images(
    chart: Chart, title: str = "", kinds: Sequence[Kind] = ("svg", "png")
) -> dict[Kind, bytes]:
    """Return a chart as the content of files, by kind."""
    figure, files = draw(chart), {}
    for kind in kinds:
        target = io.BytesIO()
        metadata: dict[str, Any] = {"Title": printable(title)} if title else {}
        if kind == "svg":
            # Files are reproducible.
            metadata["Date"] = None
        with style(), warnings.catch_warnings():
            # Characters without a glyph are drawn as boxes.
            warnings.filterwarnings("ignore", message="Glyph .* missing from font")
            figure.savefig(target, format=kind, dpi=_DPI, metadata=metadata)
        files[kind] = target.getvalue()
    return files


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
            # One label for all panels of the last row.
            for axes in figure.axes:
                axes.set_xlabel("")
            figure.supxlabel(_plain(chart.panels[-1].x), fontsize=10)
        if chart.failed:
            look: dict[str, Any] = {"fontsize": 44, "fontweight": "bold", "alpha": 0.35}
            look |= {"ha": "center", "va": "center", "zorder": 100}
            figure.text(0.5, 0.5, "FAILED — do not use", color=RED, **look)
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
        usual = 2.6 if chart.columns == 1 else 2.1
        if panel.wide or len(chart.panels) == 1:
            usual = 4.4
        if panel.horizontal:
            usual = 1.1 + 0.3 * max(len(panel.names), 2)
        heights[-1] = max(heights[-1], panel.height or usual)
        column = chart.columns if panel.wide else column + 1
    return places, heights


def _plain(text: str, length: int = 80) -> str:
    """Return a text as one line that matplotlib takes literally."""
    shown = printable(text)
    if len(shown) > length:
        shown = shown[: length - 1] + "…"
    # An even number of dollar signs would start a formula.
    return shown.replace("$", r"\$")


def draw_panel(panel: Panel, axes: Axes, named: set[str] | None = None) -> Axes:
    """Draw a panel and return its axes.

    Labels in `named`, of other legends, are left out; those of this panel are added.
    """
    named = set() if named is None else named
    entries: dict[str, list[Any]] = {}
    for order, mark in enumerate(panel.marks):
        handle = _DRAWERS[type(mark)](axes, mark, panel.horizontal, 2.0 + 0.01 * order)
        if mark.label:
            handles = handle if isinstance(handle, list) else [handle]
            entries.setdefault(mark.label, []).extend(handles)
    x, y = ("y", "x") if panel.horizontal else ("x", "y")
    axes.set(**{f"{x}label": _plain(panel.x), f"{y}label": _plain(panel.y)})
    if panel.x_log:
        axes.set(**{f"{x}scale": "log"})
    if panel.y_limits != (None, None):
        axes.set(**{f"{y}lim": panel.y_limits})
    if panel.names:
        _name(axes, panel)
    if not panel.y_ticks:
        axes.set_yticks([])
        axes.grid(False)
        axes.spines["left"].set_visible(False)
    if panel.title:
        axes.set_title(_plain(panel.title), loc="left", fontweight="bold", color=_DARK)
        # The common factor of the tick labels, to the left of the title.
        axes.yaxis.get_offset_text().set_horizontalalignment("right")
    entries = {label: marks for label, marks in entries.items() if label not in named}
    named |= set(entries)
    if 0 < len(entries) <= _MOST_LEGENDS:
        handles = [tuple(marks) for marks in entries.values()]
        names = [_plain(label, _LONGEST_LEGEND) for label in entries]
        look: dict[str, Any] = {"frameon": True, "framealpha": 0.8, "edgecolor": "none"}
        combined = {tuple: HandlerTuple(ndivide=1)}
        place: dict[str, Any] = {"loc": "best"}
        if panel.legend_beside:
            place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
        axes.legend(handles, names, handler_map=combined, **place, **look)
    return axes


def _name(axes: Axes, panel: Panel) -> None:
    """Label an axis with categories, of very many only with some."""
    step = -(-len(panel.names) // _MOST_NAMES)
    at = range(1, len(panel.names) + 1, step)
    names = [_plain(name, _LONGEST_NAME) for name in panel.names[::step]]
    if panel.horizontal:
        lines = [wrap(_plain(name, _LONGEST_LINES), _LINE) for name in panel.names]
        axes.set_yticks(at, ["\n".join(parts) for parts in lines[::step]])
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
        # Separate: in an SVG an area and its hatching have the same opacity.
        edge = {"facecolor": "none", "edgecolor": mark.colour, "linewidth": 0.0}
        found.append(fill(*ends, hatch="////", alpha=0.45, zorder=order, **edge))
    return found


def _bars(axes: Axes, mark: Bars, turned: bool, order: float) -> Any:
    low = np.zeros(len(mark.at)) if mark.low is None else mark.low
    look = {"color": mark.colour or _DARK, "zorder": order}
    if turned:
        return axes.barh(mark.at, mark.high - low, mark.width, left=low, **look)
    return axes.bar(mark.at, mark.high - low, mark.width, bottom=low, **look)


def _rule(axes: Axes, mark: Rule, turned: bool, order: float) -> Any:
    draw = axes.axvline if (mark.axis == "x") != turned else axes.axhline
    look = {"linestyle": _DASHES[mark.dash], "linewidth": 1.1, "zorder": order}
    return draw(mark.at, color=mark.colour or _DARK, **look)


def _span(axes: Axes, mark: Span, turned: bool, order: float) -> Any:
    draw = axes.axvspan if (mark.axis == "x") != turned else axes.axhspan
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
