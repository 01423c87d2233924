"""The report of a blind check can be read anywhere, and believes no name it shows."""

import json
import re
import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from browser import DESK, PAPER, PHONE, Seen, look, print_pages
from results import write_result
from slices import slice_of

from hdcal.blind.figure import bar_figure, confusion_figure
from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring.bar import BarResult
from hdcal.blind.scoring.scores import Scores, score
from hdcal.blind.summary import scores_report
from hdcal.blind.words import bar_row, span, with_span
from hdcal.physics.registry import EFFECTS
from hdcal.report.saving.contents import STAMP

WIDTHS = {"phone": PHONE, "desk": DESK, "paper": PAPER}
FAMILIES = {name: effect.groups[0] for name, effect in EFFECTS.items()}
NAUGHTY = (
    '<script>alert("x")</script> $\\frac{a}{b}$ \x1b[31m \N{RIGHT-TO-LEFT OVERRIDE}'
)


@cache
def made(count: int, rename: str | None = None) -> Scores:
    """Return scores of a made-up diagnoser that is right three times in four."""
    rng = np.random.default_rng(4)
    labels, answers, rival = [], [], []
    for place in range(count):
        case, names = f"case-{place}", [*EFFECTS]
        name = rename if rename and place % 3 == 0 else str(rng.choice(names))
        said = name if rng.random() < 0.75 else str(rng.choice(names))
        kind = ("effect", "effect", "null", "outside", "effect")[place % 5]
        truth = () if kind == "null" else (name,)
        r = 0.0 if kind == "null" else float(rng.choice([0.2, 0.5, 1.0, 5.0]))
        quiet = kind == "null" or r < 0.3
        program = rename or str(rng.choice(["rich", "ramp"]))
        label = Label(case, kind, truth, program, 60, r, "iid", 0.0, 1.0)
        labels.append(replace(label, spanned=True if kind == "outside" else None))
        chances = {said: 0.7, "none": 0.2, "unknown": 0.1}
        if quiet:
            chances = {said: 0.1, "none": 0.85, "unknown": 0.05}
        word = "none" if quiet else "named"
        effect = None if quiet else said
        own = {said: chances[said]}
        answer = CaseAnswer(
            case, word, effect, None, (said, "none"), chances, own, not quiet
        )
        answers.append(answer)
        rival.append(replace(answer, verdict="none", effect=None, detected=False))
    families = FAMILIES | ({rename: rename} if rename else {})
    return score(labels, {"hdcal": answers, rename or "none": rival}, families)


SETS = {
    "many": (400, None),
    "naughty": (120, NAUGHTY),
    "few": (3, None),
    "no": (0, None),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Callable[[str], Path]:
    """Write the report of a set; each is drawn once."""

    @cache
    def write(name: str) -> Path:
        target = tmp_path_factory.mktemp(name)
        write_result(scores_report(made(*SETS[name])), target, force=True)
        return target

    return write


@pytest.fixture(scope="module", params=slice_of(SETS, ["naughty", "no"]))
def folder(request, written) -> Path:
    """A written report, one kind after the other."""
    return written(request.param)


@pytest.fixture(scope="module")
def seen(folder: Path, tmp_path_factory) -> Seen:
    """The report as the browser sees it."""
    return look(folder / "report.html", tmp_path_factory.mktemp("browser"))


@pytest.mark.parametrize("place", WIDTHS)
def test_every_figure_shows(seen: Seen, place: str):
    frame = seen.frames[place]
    assert len(frame["images"]) == 4
    for image in frame["images"]:
        # A tall one shrinks on paper, to fit a sheet.
        room = min(WIDTHS[place], image["natural"] + 1.0)
        assert (0.2 if place == "paper" else 0.5) * room < image["width"] <= room
        assert image["height"] > 50
    assert frame["text"] > 1000


@pytest.mark.parametrize("place", WIDTHS)
def test_nothing_is_wider_than_the_page(seen: Seen, place: str):
    assert seen.frames[place]["width"] <= WIDTHS[place]
    assert not seen.frames[place]["past"]


def test_the_browser_has_nothing_to_complain_of_and_asks_nobody(seen: Seen):
    assert not seen.complaints
    assert not seen.requests


def test_it_can_be_printed(folder: Path, tmp_path: Path):
    assert 2 <= print_pages(folder / "report.html", tmp_path) <= 17


@pytest.mark.usefixtures("undrawn")
def test_everything_is_written_and_may_be_replaced(folder: Path, tmp_path: Path):
    folder = shutil.copytree(folder, tmp_path / "copy")
    names = {entry.name for entry in folder.iterdir()}
    pictures = {"bar", "confusion", "reliability", "detection"}
    kinds = {f"{name}.{kind}" for name in pictures for kind in ("svg", "png")}
    assert names == {"scores.json", "report.html", STAMP} | kinds
    stamped = json.loads((folder / STAMP).read_text("utf-8"))["files"]
    assert {one["file"] for one in stamped} == names - {STAMP}
    write_result(scores_report(made(*SETS["few"])), folder, force=True)
    assert {entry.name for entry in folder.iterdir()} == names


def fields_of(value) -> dict:
    """Return the fields of a dataclass, with the names that JSON gives them."""
    return {name.rstrip("_"): field for name, field in vars(value).items()}


def test_the_json_holds_the_scores_and_no_nan(written):
    found = made(*SETS["naughty"])
    text = (written("naughty") / "scores.json").read_text("utf-8")
    assert "NaN" not in text and "Infinity" not in text
    # Tuples become lists, nothing else changes.
    assert json.loads(text) == json.loads(json.dumps(found, default=fields_of))


def test_names_from_outside_stay_names(written):
    folder = written("naughty")
    page = (folder / "report.html").read_text("utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;alert" in page
    assert "\x1b" not in page and "\N{RIGHT-TO-LEFT OVERRIDE}" not in page
    figures = list(folder.glob("*.svg"))
    assert figures
    for svg in figures:
        assert "<script" not in svg.read_text("utf-8")


def test_met_and_missed_are_said_in_words(written):
    found = made(*SETS["many"])
    page = (written("many") / "report.html").read_text("utf-8")
    tags = Counter(re.findall(r'<span class="tag [^"]*">(\w+)', page))
    assert tags["met"] == found.summary.met > 0
    assert tags["missed"] == found.summary.missed > 0
    assert tags["no"] == found.summary.open
    assert all(row.what in page for row in found.bar if "'" not in row.what)


def test_the_same_scores_give_the_same_files(written, tmp_path: Path):
    write_result(scores_report(made(*SETS["few"])), tmp_path, force=True)
    entries = list(written("few").iterdir())
    assert entries
    for entry in entries:
        assert entry.read_bytes() == (tmp_path / entry.name).read_bytes()


ROW = BarResult(
    key="x", what="x", value=0.934, lo=0.9, hi=0.95, n=10, interval="", target=0.9,
    direction="at least", unit="share", met=True, firm=True,
)  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ("met", "93.4 %", "90.0 … 95.0 %", "≥ 90 %")),
        ({"firm": False}, ("met, not firmly", "93.4 %", "90.0 … 95.0 %", "≥ 90 %")),
        (
            {"met": False, "unit": "points", "direction": "at most", "target": 0.04},
            ("missed", "93.4 points", "90.0 … 95.0 points", "≤ 4 points"),
        ),
        (
            {"met": None, "target": None, "lo": None, "direction": None},
            ("no target", "93.4 %", "–", "–"),
        ),
        (
            {"met": None, "value": None, "lo": None, "target": (0.90, 0.98)},
            ("no cases", "–", "–", "90 … 98 %"),
        ),
        (
            {"unit": "p", "value": 0.001, "lo": None, "target": 0.01},
            ("met", "< 0.01", "–", "≥ 0.01"),
        ),
    ],
)
def test_a_row_in_words(changes: dict, words: tuple):
    _, word, value, target, span, *_ = bar_row(replace(ROW, **changes))
    assert (str(word), value, span, target) == words


def test_a_number_with_its_interval_in_words():
    assert with_span(ROW) == "93.4 % (90.0 … 95.0 %)"
    assert with_span(None) == "–"
    assert span(replace(ROW, lo=-1.234, hi=0.5), "nat") == "−1.23 … 0.50"


def test_a_number_past_the_edge_of_its_panel_stands_at_the_edge():
    rows = [replace(ROW, value=-5.0, lo=-6.0, hi=7.0, unit="points")]
    axes = bar_figure(rows).axes[0]
    low, high = axes.get_xlim()
    places = [x for line in axes.lines for x in line.get_xdata()]
    assert all(low < x < high for x in places)


def test_figures_are_drawn_of_the_scores_alone():
    found = made(60)
    drawn = bar_figure(found.bar)
    assert len(drawn.axes) == 2
    shown = [
        text.get_text().replace("\n", " ") for text in drawn.axes[0].get_yticklabels()
    ]
    rows = [r for r in found.bar if r.value is not None and r.unit != "p"]
    assert shown == [r.what for r in rows if r.unit in ("share", "points")]
    matrix = confusion_figure(found.confusion)
    texts = [text.get_text() for text in matrix.axes[0].texts]
    counts = [n for line in found.confusion.counts for n in line if n]
    assert texts == [str(n) for n in counts]
