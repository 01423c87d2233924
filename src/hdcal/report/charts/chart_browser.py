"""Data of an interactive chart, for the script `touch.js` of the page."""

import json
from typing import Any

import numpy as np

from hdcal.report.charts.chart_spec import (
    Band,
    Chart,
    Line,
    Panel,
    Points,
    Rule,
    Span,
    drawn_rows,
)

# More digits than a zoomed chart shows.
_DIGITS = 6


def chart_json(chart: Chart) -> str:
    """Return a chart as the text of a script element, which cannot end the element."""
    # Panels below each other take the whole row, as in the image.
    whole = chart.columns == 1
    panels = [_Columns(panel, panel.wide or whole).to_dict() for panel in chart.panels]
    return json.dumps(panels, separators=(",", ":")).replace("<", "\\u003c")


class _Columns:
    """Series of a panel over one axis, as uPlot takes them."""

    def __init__(self, panel: Panel, wide: bool):
        self._panel, self._wide = panel, wide
        self._series: list[dict[str, Any]] = []
        self._values: list[tuple[np.ndarray, np.ndarray, bool]] = []
        self._bands: list[tuple[int, int, float]] = []
        self._errors: list[tuple[int, int, int]] = []
        self._rules: list[dict[str, Any]] = []
        self._labels: set[str] = set()
        for mark in panel.marks:
            self._add(mark)

    def to_dict(self) -> dict[str, Any]:
        panel = self._panel
        return {
            "x": panel.x,
            "y": panel.y,
            "title": panel.title,
            "height": round(110 * panel.height) or (380 if panel.wide else 300),
            "wide": self._wide,
            "limits": list(panel.y_limits),
            "log": [panel.x_log, False],
            "bands": self._bands,
            "errors": self._errors,
            "rules": self._rules,
            "series": self._series,
            "data": [_numbers(column) for column in self._data()],
        }

    def _add(self, mark: Any) -> None:
        match mark:
            case Line():
                dashed = mark.dash != "solid"
                self._append(mark, mark.x, mark.y, width=mark.width, dashed=dashed)
            case Points():
                self._points(mark)
            case Band():
                high, low = (
                    self._append(mark, mark.x, end) for end in (mark.high, mark.low)
                )
                self._bands.append((high, low, mark.opacity))
            case Rule():
                dashed = mark.dash != "solid"
                self._across(mark, mark.at, mark.at, {"dashed": dashed})
            case Span():
                self._across(mark, mark.low, mark.high, {"opacity": mark.opacity})

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

    def _across(self, mark: Rule | Span, low: float, high: float, look: dict) -> None:
        """Add a rule or span, and an empty series for its label in the legend."""
        ends = {"axis": mark.axis, "low": low, "high": high, "colour": mark.colour}
        self._rules.append(ends | look)
        if mark.label:
            none = np.empty(0)
            dashed = look.get("dashed", False)
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
        """Add a series and return its place; an `edge` has neither line nor symbols."""
        look = {"points": points and not edge, "width": width, "dashed": dashed}
        # Marks with the same label share the entry of the first one.
        label = "" if mark.label in self._labels else mark.label
        self._labels.add(label)
        self._series.append({"label": label, "colour": mark.colour, **look})
        self._values.append((np.asarray(x, float), np.asarray(y, float), points))
        return len(self._series) - 1

    def _data(self) -> list[np.ndarray]:
        """Return the common axis and each series over it; NaN without a value.

        Curves are interpolated; points have rows of their own.
        """
        curves = [x for x, _, points in self._values if not points]
        shared = np.unique(np.concatenate(curves)) if curves else np.empty(0)
        # Ends of error bars have the rows of their points.
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


def _numbers(values: np.ndarray) -> list[float | None]:
    return [
        float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
        for value in values
    ]
