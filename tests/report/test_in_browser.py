"""Both reports can be read in a real browser: on a screen, a phone and paper."""

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
