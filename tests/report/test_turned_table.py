"""A long table is turned page by page, sorted and searched in a browser."""

from pathlib import Path
from typing import Literal

import pytest
from browser import look, play

from hdcal.report.result import Result

SIZE, PAGE = 60, 25
# Softest last; the middle one has no number.
ROWS = [[f"G{k:02d}", f"{SIZE - k} N", "off" if k == 7 else ""] for k in range(SIZE)]
ROWS[30][1] = "–"


class Gears(Result):
    """A long table."""

    template = ""
    table = ""

    format: Literal["hdcal.gears/1"] = "hdcal.gears/1"

    def block(self, name, command="", **_):
        lines = [f"| {' | '.join(row)} |" for row in ROWS]
        table = "\n".join(["| gear | N/mm | |", "|---|---:|---|", *lines])
        return table if name == "body" else ""


ACT = """
  for (const folded of page.querySelectorAll("details")) folded.open = true;
  const names = () => [...page.querySelectorAll("tbody tr")].filter(
    row => row.offsetParent).map(row => row.cells[0].textContent);
  const bar = page.querySelector(".turn"), found = {first: names()};
  const [back, on] = bar.querySelectorAll("button");
  const wanted = bar.querySelector("input");
  found.ends = [back.disabled, on.disabled];
  on.click(); on.click();
  found.last = names(); found.told = bar.querySelector("span").textContent;
  found.after = [back.disabled, on.disabled];
  const [, stiffness] = page.querySelectorAll("th button");
  stiffness.click(); found.softest = names();
  stiffness.click(); found.stiffest = names();
  wanted.value = "OFF"; wanted.dispatchEvent(new Event("input")); found.off = names();
  wanted.value = "nowhere"; wanted.dispatchEvent(new Event("input"));
  found.none = [names().length, bar.querySelector("span").textContent];
  wanted.value = ""; wanted.dispatchEvent(new Event("input"));
  const rows = () => page.querySelectorAll("tbody tr").length;
  const frame = page.defaultView;
  frame.dispatchEvent(new frame.Event("beforeprint")); found.printed = rows();
  frame.dispatchEvent(new frame.Event("afterprint")); found.again = rows();
  return found;
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("page") / "page.html"
    place.write_text(Gears().page(), "utf-8")
    return place


def test_a_browser_turns_sorts_and_searches(page: Path, tmp_path: Path):
    found, names = play(page, tmp_path, ACT), [row[0] for row in ROWS]
    assert found["first"] == names[:PAGE] and found["ends"] == [True, False]
    assert found["last"] == names[2 * PAGE :] and found["after"] == [False, True]
    assert found["told"] == "51 to 60 of 60"
    numbered = [name for name in names if name != "G30"]
    assert found["softest"] == numbered[::-1][:PAGE]
    assert found["stiffest"] == numbered[:PAGE]
    assert found["off"] == ["G07"]
    assert found["none"] == [0, "none"]
    assert (found["printed"], found["again"]) == (SIZE, PAGE)


def test_it_fits_everywhere_and_nothing_is_complained_of(page: Path, tmp_path: Path):
    seen = look(page, tmp_path)
    assert not seen.complaints and not seen.requests
    assert all(not frame["past"] for frame in seen.frames.values())


def test_what_has_no_number_comes_last(page: Path, tmp_path: Path):
    last = """
      const bar = page.querySelector(".turn"), on = bar.querySelectorAll("button")[1];
      page.querySelectorAll("th button")[1].click(); on.click(); on.click();
      const rows = page.querySelectorAll("tbody tr");
      return {last: rows[rows.length - 1].cells[0].textContent};
    """
    assert play(page, tmp_path, last) == {"last": "G30"}
