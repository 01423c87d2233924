"""Every mark of a chart is drawn by Matplotlib and by the browser."""

import json
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from browser import look
from matplotlib.figure import Figure

from hdcal.report.charts.chart_browser import chart_json
from hdcal.report.charts.chart_drawing import draw, draw_panel, images
from hdcal.report.charts.chart_spec import (
    MOST_DRAWN,
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
from hdcal.report.result import Result

X = np.array([0.0, 1.0, 2.0])
MARKS = {
    "line": Line(label="a", x=X, y=X),
    "points": Points(label="a", x=X, y=X),
    "errors": Points(label="a", x=X, y=X, low=X - 1.0, high=X + 2.0),
    "band": Band(label="a", x=X, low=X - 1.0, high=X + 2.0, hatched=True),
    "bars": Bars(label="a", at=X + 1.0, low=X, high=X + 2.0),
    "rule": Rule(label="a", at=2.0, axis="x"),
    "span": Span(label="a", low=-1.0, high=2.0, axis="y"),
}


def panel(*marks, **more) -> Panel:
    return Panel(x="x [mm]", y="y [N]", marks=marks, **more)


def browser(*marks, **more) -> dict:
    return json.loads(chart_json(Chart(panels=[panel(*marks, **more)])))[0]


@pytest.mark.parametrize("name", MARKS)
@pytest.mark.parametrize("turned", [False, True])
def test_a_mark_is_drawn(name: str, turned: bool):
    axes = draw_panel(panel(MARKS[name], horizontal=turned), Figure().add_subplot())
    labels = axes.get_ylabel(), axes.get_xlabel()
    assert labels == (("x [mm]", "y [N]") if turned else ("y [N]", "x [mm]"))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a"]
    axes.figure.canvas.draw()
    across, up = axes.dataLim.intervalx, axes.dataLim.intervaly
    if name in ("errors", "band"):
        low, high = across if turned else up
        assert (low, high) == (-1.0, 4.0)


def test_the_browser_has_curves_at_every_place_and_points_in_their_rows():
    found = browser(MARKS["line"], Points(x=np.array([0.5]), y=np.array([9.0])))
    over, line, points = found["data"]
    assert over == [0.0, 0.5, 1.0, 2.0] and line == over
    assert points == [None, 9.0, None, None]


def test_the_browser_has_error_bars_bands_and_rules():
    found = browser(MARKS["errors"], MARKS["band"], MARKS["rule"], MARKS["span"])
    ((at, low, high),) = found["errors"]
    columns = found["data"][1:]
    kept = [i for i, value in enumerate(columns[at]) if value is not None]
    assert [columns[low][i] for i in kept] == [-1.0, 0.0, 1.0]
    assert [columns[high][i] for i in kept] == [2.0, 3.0, 4.0]
    upper, lower, _ = found["bands"][0]
    assert max(filter(None, columns[upper])) == 4.0
    assert min(v for v in columns[lower] if v is not None) == -1.0
    assert [rule["low"] for rule in found["rules"]] == [2.0, -1.0]
    gap = browser(Band(x=X, low=X, high=np.array([1.0, np.nan, 1.0])))
    assert gap["data"][1] == [1.0, None, 1.0]


def test_axes_are_logarithmic_limited_and_named():
    line, look = Line(x=X + 1.0, y=X + 1.0), {"x_log": True}
    axes = draw_panel(panel(line, y_limits=(0.5, None), **look), Figure().add_subplot())
    assert axes.get_xscale() == "log" and axes.get_ylim()[0] == 0.5
    assert browser(line, **look)["log"] == [True, False]
    names = ["<b>", "$x$", "n" * 90]
    named = draw_panel(panel(MARKS["bars"], names=names), Figure().add_subplot())
    texts = [text.get_text() for text in named.get_xticklabels()]
    assert texts[:2] == ["<b>", r"\$x\$"] and len(texts[2]) < 30
    assert "<b>" not in chart_json(Chart(panels=[panel(line, title="<b>")]))


def test_panels_are_placed_in_rows_below_a_wide_one():
    small = [panel(MARKS["line"]) for _ in range(3)]
    chart = Chart(panels=[panel(MARKS["line"], wide=True), *small], columns=2)
    figure = draw(chart)
    rows = [axes.get_subplotspec() for axes in figure.axes]
    assert [each.rowspan.start for each in rows] == [0, 1, 1, 2]
    assert [each.colspan.start for each in rows] == [0, 0, 1, 0]
    assert rows[0].colspan.stop == 2
    wide = [each["wide"] for each in json.loads(chart_json(chart))]
    assert wide == [True, False, False, False]
    below = json.loads(chart_json(Chart(panels=small)))
    assert [each["wide"] for each in below] == 3 * [True]
    # The legend of the first panel is that of all.
    assert [axes.get_legend() is None for axes in figure.axes] == [False] + 3 * [True]


def test_a_failed_chart_is_marked_and_files_are_reproducible():
    chart = Chart(panels=[panel(MARKS["line"])], failed=True)
    assert [text.get_text() for text in draw(chart).texts] == ["FAILED — do not use"]
    first, again = images(chart, "title"), images(chart, "title")
    assert first == again
    assert first["svg"].startswith(b"<?xml") and first["png"].startswith(b"\x89PNG")


def test_the_largest_of_many_points_are_drawn():
    y = np.random.default_rng(0).normal(size=3 * MOST_DRAWN)
    y[7] = 1e6
    rows = drawn_rows(y)
    assert 7 in rows and MOST_DRAWN <= len(rows) <= MOST_DRAWN + 50


class Marks(Result):
    """Every mark in one page."""

    template = ""
    table = ""

    format: Literal["hdcal.marks/1"] = "hdcal.marks/1"

    def block(self, name, command="", **_):
        return "![all](all 'All')" if name == "body" else ""

    def make_charts(self):
        logs = panel(Line(x=X + 1.0, y=X + 1.0), x_log=True, title="<b>")
        panels = [panel(mark) for name, mark in MARKS.items() if name != "bars"]
        return {"all": Chart(panels=[*panels, logs])}


def test_a_browser_draws_every_mark_without_complaints(tmp_path: Path):
    page = tmp_path / "page.html"
    page.write_text(Marks().page(), "utf-8")
    seen = look(page, tmp_path)
    assert (seen.complaints, seen.requests) == ([], [])
    assert all(not frame["past"] for frame in seen.frames.values())
    assert seen.frames["phone"]["canvases"] == len(MARKS)
    assert len(seen.frames["paper"]["images"]) == 1
