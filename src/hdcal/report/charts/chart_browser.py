"""The data of an interactive chart, for the script `touch.js` of the page."""

import json
from typing import Any

import numpy as np

from hdcal.report.charts.chart_spec import (
    Band,
    Bars,
    Chart,
    Line,
    Panel,
    Points,
    Rule,
    Span,
    drawn_rows,
)

# More digits than a screen shows when it is zoomed in.
_DIGITS = 6


def chart_json(chart: Chart) -> str:
    """Return a chart as the text of a script element, in which nothing can end it."""
    panels = [_Columns(panel).plain() for panel in chart.panels]
    return json.dumps(panels, separators=(",", ":")).replace("<", "\\u003c")


class _Columns:
    """Series of one panel over a common axis, as uPlot takes them."""

    def __init__(self, panel: Panel):
        self._panel = panel
        self._series: list[dict[str, Any]] = []
        self._values: list[tuple[np.ndarray, np.ndarray, bool]] = []
        self._bands: list[tuple[int, int, float]] = []
        self._errors: list[tuple[int, int, int]] = []
        self._rules: list[dict[str, Any]] = []
        self._labelled: dict[str, Any] = {}
        for mark in panel.marks:
            self._add(mark)

    def plain(self) -> dict[str, Any]:
        """Return the panel as JSON holds it."""
        panel = self._panel
        return {
            "x": panel.x,
            "y": panel.y,
            "title": panel.title,
            "height": round(110 * panel.height) or (380 if panel.wide else 300),
            "ticks": panel.y_ticks,
            "wide": panel.wide,
            "names": list(panel.names),
            "limits": list(panel.y_limits),
            "log": [panel.x_log, panel.y_log],
            "bands": self._bands,
            "errors": self._errors,
            "rules": self._rules,
            "series": self._series,
            "data": [_numbers(column) for column in self._data()],
        }

    def _add(self, mark: Any) -> None:
        match mark:
            case Line(steps=True):
                self._curve(mark, *_stairs(mark.x, mark.y))
            case Line():
                self._curve(mark, mark.x, mark.y)
            case Points():
                self._points(mark)
            case Band():
                self._band(mark, mark.x, mark.low, mark.high, mark.opacity)
            case Bars():
                low = np.zeros(len(mark.at)) if mark.low is None else mark.low
                ends = [_boxes(mark, values) for values in (low, mark.high)]
                self._band(mark, ends[0][0], ends[0][1], ends[1][1], 0.7)
            case Rule():
                each = {"axis": mark.axis, "low": mark.at, "high": mark.at}
                dashed = mark.dash != "solid"
                self._rules.append(each | {"colour": mark.colour, "dashed": dashed})
                self._name(mark, dashed=dashed)
            case Span():
                each = {"axis": mark.axis, "low": mark.low, "high": mark.high}
                look = {"colour": mark.colour, "opacity": mark.opacity}
                self._rules.append(each | look)
                self._name(mark)

    def _curve(self, mark: Line, x: np.ndarray, y: np.ndarray) -> None:
        dashed = mark.dash != "solid"
        self._append(mark, x, y, width=mark.width, dashed=dashed)

    def _points(self, mark: Points) -> None:
        rows = drawn_rows(mark.y)
        x = np.asarray(mark.x, float)[rows]
        place = self._append(mark, x, mark.y[rows], points=True)
        if mark.low is not None and mark.high is not None:
            low, high = (
                self._append(mark, x, end[rows], points=True, edge=True)
                for end in (mark.low, mark.high)
            )
            self._errors.append((place, low, high))

    def _band(
        self, mark: Band | Bars, x: Any, low: Any, high: Any, opacity: float
    ) -> None:
        upper = self._append(mark, x, high, edge=True)
        self._bands.append((upper, self._append(mark, x, low, edge=True), opacity))

    def _name(self, mark: Rule | Span, *, dashed: bool = False) -> None:
        """Add a series without points, so that the legend shows the label."""
        if mark.label:
            none = np.empty(0)
            self._append(mark, none, none, points=True, dashed=dashed)

    def _append(
        self,
        mark: Any,
        x: np.ndarray,
        y: np.ndarray,
        *,
        points: bool = False,
        edge: bool = False,
        width: float = 0.0,
        dashed: bool = False,
    ) -> int:
        """Add a series and return its place; an `edge` has no line and no legend."""
        look = {"points": points and not edge, "width": width, "dashed": dashed}
        # Of marks with the same label the legend shows the first one.
        first = self._labelled.setdefault(mark.label, mark) is mark
        label = mark.label if first else ""
        self._series.append({"label": label, "colour": mark.colour, **look})
        self._values.append((np.asarray(x, float), np.asarray(y, float), points))
        return len(self._series) - 1

    def _data(self) -> list[np.ndarray]:
        """Return the common axis and each series over it; NaN where it has no value.

        Curves are interpolated at every place; points keep the rows of their own.
        """
        curves = [x for x, _, points in self._values if not points]
        shared = np.unique(np.concatenate(curves)) if curves else np.empty(0)
        # Ends of error bars stand in the rows of their points.
        sets = {id(x): x for x, _, points in self._values if points}
        starts, size = {}, len(shared)
        for key, x in sets.items():
            starts[key], size = size, size + len(x)
        over = np.concatenate([shared, *sets.values()])
        order = np.argsort(over, kind="stable")
        columns = [over[order]]
        for x, y, points in self._values:
            if points:
                column = np.full(size, np.nan)
                column[starts[id(x)] : starts[id(x)] + len(x)] = y
            else:
                column = np.interp(over, x, y, left=np.nan, right=np.nan)
            columns.append(column[order])
        return columns


def _stairs(edges: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a curve that is level between edges; all its places differ."""
    starts = edges[:-1] + 1e-3 * np.diff(edges)
    return np.column_stack([starts, edges[1:]]).ravel(), np.repeat(levels, 2)


def _boxes(mark: Bars, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a curve that is level along each bar, and interrupted between them."""
    half = mark.width / 2.0
    x = np.column_stack([mark.at - half, mark.at + half, mark.at + 1.01 * half])
    y = np.column_stack([values, values, np.full(len(values), np.nan)])
    return x.ravel(), y.ravel()


def _numbers(values: np.ndarray) -> list[float | None]:
    return [
        float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
        for value in values
    ]
