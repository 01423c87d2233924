"""Interactive charts of a page in a browser."""

import re

import pytest
from browser import Seen, look, play
from commands import Done


@pytest.fixture(scope="module")
def seen(calibrated: tuple[Done, object], tmp_path_factory) -> Seen:
    return look(calibrated[1] / "report.html", tmp_path_factory.mktemp("browser"))


def test_screens_show_charts_and_paper_the_images(seen: Seen):
    images = {place: len(frame["images"]) for place, frame in seen.frames.items()}
    # Bands and residuals are interactive, densities are not.
    assert images == {"phone": 1, "desk": 1, "paper": 3}
    assert seen.frames["desk"]["canvases"] == 2 + 2
    assert not seen.complaints and not seen.requests


ACT = """
const all = name => [...page.querySelectorAll(name)], frame = page.defaultView;
const over = all(".u-over"), canvas = all("canvas");
const pictures = () => canvas.map(each => each.toDataURL());
const later = () => new Promise(done => setTimeout(done, 300));
const box = over[0].getBoundingClientRect();
const act = (kind, x, target = over[0]) => target.dispatchEvent(
  new MouseEvent(kind, {clientX: box.x + x, clientY: box.y + 100, movementX: 9,
    bubbles: true, cancelable: true}));
await later();
const first = pictures();
act("mousemove", 200);
await later();
const rows = [...page.querySelector(".u-legend").querySelectorAll(".u-series")]
  .filter(each => each.offsetHeight > 0);
const legend = rows.map(each => each.innerText);
const colours = rows.filter(row => row.querySelector(".u-marker")).map(row =>
  [row.querySelector(".u-label").innerText,
   frame.getComputedStyle(row.querySelector(".u-marker")).backgroundColor]);
act("mousedown", 200); act("mousemove", 400); act("mouseup", 400, page);
await later();
const zoomed = pictures();
over.slice(0, 2).forEach(each => act("dblclick", 300, each));
await later();
return {zoomed: zoomed.map((each, k) => each !== first[k]),
  back: pictures().map((each, k) => each === first[k]), legend, colours};
"""


def test_dragging_zooms_both_panels_and_the_legend_shows_values(calibrated, tmp_path):
    found = play(calibrated[1] / "report.html", tmp_path, ACT)
    assert found["zoomed"] == [True, True, False, False] and all(found["back"])
    legend = [" ".join(row.split()) for row in found["legend"]]
    assert sum(bool(re.search(r" ?-?\d", row)) for row in legend) >= 4
    # Both ends of a band are in one row, under the name of the band.
    assert re.search(r"mean force[^|]* ?[-\d.]+ … [-\d.]+", " | ".join(legend))
    labels, colours = zip(*found["colours"], strict=True)
    assert len(labels) == len(set(labels)) == len(set(colours)) >= 4
