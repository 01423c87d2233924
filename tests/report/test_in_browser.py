"""Both reports can be read in a real browser: on a screen, a phone and paper."""

import re
from pathlib import Path

import pytest
from browser import DESK, PAPER, PHONE, Seen, look, print_pages
from commands import Done
from diagnosis_cases import judged, rich, simulated
from slices import slice_of

from hdcal.report.result_folder import page_files

WIDTHS = {"phone": PHONE, "desk": DESK, "paper": PAPER}
Calibrated = tuple[Done, Path]
REPORTS = ["calibration", "diagnosis", "none", "failed"]


@pytest.fixture(scope="module")
def reports(calibrated: Calibrated, tmp_path_factory) -> dict[str, Path]:
    """Every kind of report, on disk."""
    loop = judged(simulated(rich(), {"hysteresis": {"force": 4.0, "reach": 0.1}}))
    results = {
        "diagnosis": loop,
        "none": judged(simulated(rich())),
        "failed": loop.model_copy(update={"reasons": ("the sampler diverged",)}),
    }
    pages = {"calibration": calibrated[1] / "report.html"}
    for name, result in results.items():
        folder = tmp_path_factory.mktemp(name)
        for file, content in page_files(result, f"hdcal diagnose {name}").items():
            (folder / file).write_bytes(content)
        pages[name] = folder / "report.html"
    return pages


@pytest.fixture(scope="module", params=slice_of(REPORTS, ["calibration", "failed"]))
def report(request, reports: dict[str, Path]) -> Path:
    """One report after the other."""
    return reports[request.param]


@pytest.fixture(scope="module")
def seen(report: Path, tmp_path_factory) -> Seen:
    """The report as the browser sees it."""
    return look(report, tmp_path_factory.mktemp("browser"))


@pytest.mark.parametrize("place", WIDTHS)
def test_every_figure_shows(seen: Seen, place: str):
    frame = seen.frames[place]
    # On a screen interactive charts replace some.
    canvases = 0 if place == "paper" else frame["canvases"]
    assert len(frame["images"]) + canvases >= 3
    for image in frame["images"]:
        assert image["natural"] > 0
        room = min(WIDTHS[place], image["natural"])
        assert 0.5 * room < image["width"] <= room
        assert image["height"] > 50
    assert frame["text"] > 1000
    # Details are folded, but on paper.
    assert frame["first"] < (1500 if place != "paper" else 1e6)
    assert frame["first"] == frame["text"] or place != "paper"


def test_it_fits_without_complaints_or_requests(seen: Seen):
    for place, width in WIDTHS.items():
        frame = seen.frames[place]
        assert frame["width"] <= width and not frame["past"], frame["past"]
    assert not seen.complaints and not seen.requests


def test_it_can_be_printed(report: Path, tmp_path: Path):
    assert 2 <= print_pages(report, tmp_path) <= 15


POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy"[^>]*>')


def planted(report: Path, tmp_path: Path, words: str, *, policy: bool = False) -> Seen:
    """Return what is seen of a report with something planted at its end.

    Without its policy, unless that is wanted: what is planted has to act.
    """
    page = report.read_text("utf-8")
    assert page.count("</body>") == 1 and len(POLICY.findall(page)) == 1
    page = page.replace("</body>", words + "</body>")
    (tmp_path / "page.html").write_text(page if policy else POLICY.sub("", page))
    return look(tmp_path / "page.html", tmp_path)


SCRIPT = "<script>document.body.append('planted '.repeat(9999))</script>"
IMAGE = '<img src="http://example.invalid/x.png" alt="">'
STYLE = '<style>body { min-width: 3000px }</style><p style="width: 3000px">x</p>'


def test_the_policy_lets_nothing_planted_act(reports, tmp_path: Path):
    """And what the page brings along looks as it does without one."""
    words = SCRIPT + IMAGE + STYLE + '<iframe src="data:text/html,x"></iframe>'
    kept = planted(reports["none"], tmp_path, words, policy=True)
    free = planted(reports["none"], tmp_path, words)
    plain = look(reports["none"], tmp_path)
    assert any("example.invalid" in request for request in free.requests)
    assert not kept.requests
    assert {"script-src", "img-src", "style-src"} <= {
        kind for line in kept.complaints for kind in _directives(line)
    }
    for place in WIDTHS:
        frame, usual = kept.frames[place], plain.frames[place]
        assert free.frames[place]["width"] > 2000 >= frame["width"] == usual["width"]
        assert free.frames[place]["text"] > 50_000 > usual["text"] + 100
        assert frame["text"] < usual["text"] + 100
        # One image more, which shows nothing.
        assert frame["images"][: len(usual["images"])] == usual["images"]


def _directives(line: str) -> list[str]:
    """Return the kinds of sources that a line of the console speaks of."""
    return re.findall(r"\b(?:script|img|style|default)-src\b", line)


def test_planted_faults_are_caught(reports, tmp_path: Path):
    # On a phone a wide table scrolls, paper cannot.
    words = '<div class="wide"><table><td style="min-width: 900px">x</td></table></div>'
    seen = planted(reports["none"], tmp_path, words)
    assert not seen.frames["phone"]["past"] and seen.frames["paper"]["past"]
    words = '<p style="width: 1000px">wide</p><script>undefined.planted</script>'
    seen = planted(reports["none"], tmp_path, words)
    assert any("planted" in line for line in seen.complaints)
    assert seen.frames["phone"]["width"] > PHONE and seen.frames["phone"]["past"]
    assert not seen.frames["desk"]["past"]
