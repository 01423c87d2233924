"""A result that must not be used says so wherever somebody could pick it up."""

import base64
import csv
import json
import re
from pathlib import Path

import pytest
from commands import XB1, Done, Hdcal
from schema_checks import obeys
from short import TOO_SHORT, options

from hdcal.calibration.answer import CalibrationAnswer

MARK = "FAILED — do not use"


@pytest.fixture(scope="module")
def failed(hdcal: Hdcal, tmp_path_factory: pytest.TempPathFactory) -> tuple[Done, Path]:
    """A run far too short to have converged."""
    folder = tmp_path_factory.mktemp("failed") / "result"
    hurry = options(TOO_SHORT)
    return hdcal("calibrate", XB1, *hurry, "--out", folder), folder


def test_the_command_says_so(failed: tuple[Done, Path]):
    done, _ = failed
    assert done.returncode == 1, done.stderr
    assert "FAILED: this result must not be used." in done.stdout


def test_the_summary_says_so(failed: tuple[Done, Path]):
    summary = json.loads((failed[1] / "summary.json").read_text("utf-8"))
    obeys(summary, CalibrationAnswer)
    assert summary["status"] == "failed"
    assert summary["reasons"]
    assert "must not be used" in summary["headline"]
    assert summary["next_step"].startswith("Do not use this result.")


def test_every_figure_says_so(failed: tuple[Done, Path]):
    assert MARK in (failed[1] / "calibration.svg").read_text("utf-8")
    page = (failed[1] / "report.html").read_text("utf-8")
    images = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)
    assert len(images) == 4
    assert all(MARK in base64.b64decode(image).decode() for image in images)


def test_the_report_says_so_first(failed: tuple[Done, Path]):
    page = (failed[1] / "report.html").read_text("utf-8")
    assert page.index("FAILED — do not use this result") < page.index("Stiffness: ")


def test_no_band_is_marked_usable(failed: tuple[Done, Path]):
    with (failed[1] / "bands.csv").open() as stream:
        assert {row["usable"] for row in csv.DictReader(stream)} == {"false"}


def test_nothing_is_predicted_from_it(failed: tuple[Done, Path], here: Hdcal):
    done = here("predict", failed[1], "--deformation", "0.1", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "failed"
    assert "must not be used" in done.stderr
