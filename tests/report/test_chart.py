"""Pictures that one can touch: the same numbers, and a browser that moves them."""

import json
import re

import numpy as np
import pytest
from browser import Seen, look, play
from commands import Done
from matplotlib.figure import Figure

from hdcal.report.chart import Chart, Series, boxes, charts_json
from hdcal.report.chart_figure import draw_chart
from hdcal.report.document import Document, Picture, Section
from hdcal.report.html import html_page

X = np.array([0.0, 1.0, 2.0, 3.0])
CURVE = Series("curve </script>", X, 10.0 * X, "#0072B2")
TORN = Series("torn", X, np.array([0.0, 1.0, np.nan, 3.0]), "#0072B2")
POINTS = Series(
    "points", np.array([2.5, 0.5, 0.5]), np.array([1.0, 2.0, 3.0]), "", True
)
CHART = Chart("x [mm]", "y [N]", [CURVE, TORN, POINTS], [(0, 1, 0.2)])


def test_series_share_their_places():
    """Curves go on where points lie, by a straight line; points are nowhere else."""
    text = charts_json([CHART])
    assert "</script>" not in text
    (plain,) = json.loads(text)
    x, curve, torn, points = plain["data"]
    assert x == [0.0, 0.5, 0.5, 1.0, 2.0, 2.5, 3.0]
    assert curve == [10.0 * at for at in x]
    assert torn == [0.0, 0.5, 0.5, 1.0, None, None, 3.0]
    assert points == [None, 2.0, 3.0, None, None, 1.0, None]
    assert plain["series"][0]["label"] == CURVE.label
    assert plain["bands"] == [[0, 1, 0.2]]


def test_boxes_are_level_and_nothing_is_between_them():
    x, y = boxes(np.array([0.0, 1.0]), np.array([1.0, 3.0]), np.array([5.0, 7.0]))
    assert (np.diff(x) > 0.0).all() and x[0] > 0.0 and x[-1] < 3.0
    over = np.array([0.5, 1.0, 2.0])
    np.testing.assert_array_equal(np.interp(over, x, y), [5.0, np.nan, 7.0])


def test_short_names_lie_level_and_long_ones_stand():
    place = np.arange(1.0, 10.0)
    points = [Series("points", place, place, "", points=True)]
    for names, turned in ((["a"] * 9, 0.0), (["x" * 30] * 9, 90.0)):
        axes = draw_chart(Chart("x", "y", points, names=names), Figure().add_subplot())
        assert {text.get_rotation() for text in axes.get_xticklabels()} == {turned}


def test_marked_places_keep_their_names_among_many():
    place = np.arange(1.0, 100.0)
    names = [f"gear {row:.0f}" for row in place]
    points = [Series("points", place, place, "", points=True)]
    chart = Chart("x", "y", points, names=names, marked=[7, 80])
    axes = draw_chart(chart, Figure().add_subplot())
    told = [text.get_text() for text in axes.get_xticklabels()]
    assert told == ["gear 7", "gear 80"]
    (plain,) = json.loads(charts_json([chart]))
    assert plain["marked"] == [7, 80] and plain["limits"] == [None, None]


def test_an_axis_ends_where_nothing_can_be():
    points = [Series("points", X, np.array([60.0, 80.0, 90.0, 100.0]), "", points=True)]
    chart = Chart("x", "share [%]", points, limits=(0.0, 100.0))
    low, high = draw_chart(chart, Figure().add_subplot()).get_ylim()
    assert high == 100.0 and 0.0 < low < 60.0


@pytest.fixture(scope="module")
def seen(calibrated: tuple[Done, object], tmp_path_factory) -> Seen:
    return look(calibrated[1] / "report.html", tmp_path_factory.mktemp("browser"))


def test_screens_show_charts_and_paper_the_images(seen: Seen):
    drawn = {place: len(frame["images"]) for place, frame in seen.frames.items()}
    assert drawn == {"phone": 0, "desk": 0, "paper": 4}
    # Bands, residuals, priors and ranks.
    assert seen.frames["desk"]["canvases"] == 2 + 2 + 6 + 6
    assert not seen.complaints and not seen.requests


SWATCHES = """
const rows = [...page.querySelector(".u-legend").querySelectorAll(".u-series")];
return rows.filter(row => row.offsetHeight > 0 && row.querySelector(".u-marker"))
  .map(row => [row.innerText.trim(),
    page.defaultView.getComputedStyle(row.querySelector(".u-marker")).backgroundColor]);
"""


def test_no_two_rows_of_a_legend_look_alike(calibrated, tmp_path):
    first = play(calibrated[1] / "report.html", tmp_path, SWATCHES)
    assert len(first) >= 4
    assert len({words for words, _ in first}) == len({hue for _, hue in first})
    assert len({words for words, _ in first}) == len(first)


TURN = """
const all = name => [...page.querySelectorAll(name)];
const canvas = all("canvas"), over = all(".u-over");
const pictures = () => canvas.map(each => each.toDataURL());
const later = () => new Promise(done => setTimeout(done, 300));
await later();
const first = pictures();
const box = over[0].getBoundingClientRect();
const at = {clientX: box.x + 300, clientY: box.y + 100, bubbles: true,
  cancelable: true};
over[0].dispatchEvent(new WheelEvent("wheel", {deltaY: -100, ...at}));
await later();
const turned = pictures();
over[0].dispatchEvent(new MouseEvent("mousemove", at));
await later();
const rows = all(".u-legend .u-series").filter(each => each.offsetHeight > 0);
const told = rows.map(each => each.innerText);
over[1].dispatchEvent(new MouseEvent("dblclick", at));
over[0].dispatchEvent(new MouseEvent("dblclick", at));
await later();
return {turned: turned.map((each, k) => each !== first[k]),
  back: pictures().map((each, k) => each === first[k]), told: told};
"""


def test_the_wheel_zooms_both_and_two_clicks_show_all(calibrated, tmp_path):
    found = play(calibrated[1] / "report.html", tmp_path, TURN)
    assert found["turned"] == [True, True] + 14 * [False]
    assert all(found["back"])
    said = [" ".join(row.split()) for row in found["told"]]
    assert sum(bool(re.search(r" ?-?\d", row)) for row in said) >= 4
    # Both ends of a band stand in one row, under the name of the band.
    ends = [row for row in said if "…" in row]
    assert len(ends) >= 2 and not any("2.5 %" in row for row in said)
    assert re.search(r"mean force ?[-\d.]+ … [-\d.]+", " ".join(ends))


def test_charts_over_another_axis_stay_where_they_are(tmp_path):
    other = Chart("time [s]", "y [N]", [Series("late", 5.0 * X, X, "#0072B2")])
    picture = Section("Curves", [Picture("curves", "Three of them", "")])
    words = {"name": "gear 7", "kind": "test", "subtitle": "", "headline": "Three."}
    document = Document(**words, sections=[picture], provenance=[])
    charts = {"curves": [CHART, other, CHART]}
    page = tmp_path / "page.html"
    page.write_text(html_page(document, {"curves": b"<svg/>"}, charts=charts))
    found = play(page, tmp_path, TURN)
    assert found["turned"] == [True, False, True]
    assert found["back"] == [True, True, True]
