"""Interactive charts of a page in a browser."""

import re

import pytest
from browser import Seen, look, play
from commands import Done


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
