"""A failed calibration is marked in every file, and nothing is predicted from it."""

import base64
import csv
import json
import re

from commands import XB1, Hdcal
from schema_checks import obeys
from short import TOO_SHORT, options

from hdcal.calibration.calibration import Calibration

MARK = "FAILED — do not use"


def test_a_failed_calibration_is_marked_everywhere(here: Hdcal, tmp_path):
    done = here("calibrate", XB1, *options(TOO_SHORT), "--out", "result")
    folder = tmp_path / "result"
    assert done.returncode == 1, done.stderr
    assert "FAILED: this result must not be used." in done.stdout
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    obeys(summary, Calibration)
    assert summary["status"] == "failed" and summary["reasons"]
    assert "must not be used" in summary["headline"]
    assert len(summary["next_steps"]) == 1
    assert MARK in (folder / "calibration.svg").read_text("utf-8")
    page = (folder / "report.html").read_text("utf-8")
    images = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)
    assert len(images) == 4 and "data-touch" not in page
    assert all(MARK in base64.b64decode(image).decode() for image in images)
    assert page.index(MARK) < page.index('class="answer failed-answer"')
    with (folder / "bands.csv").open() as stream:
        assert {row["usable"] for row in csv.DictReader(stream)} == {"false"}
    done = here("predict", folder, "--deformation", "0.1", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "failed"
