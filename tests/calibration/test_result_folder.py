"""`hdcal calibrate` leaves a whole folder that other tools can read."""

import base64
import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from commands import ROOT, XB1, Done, Hdcal
from schema_checks import obeys
from short import TOO_SHORT, options

from hdcal.calibration.calibration import Calibration

Calibrated = tuple[Done, Path]
BANDS = ["physics", "with_gap", "new_measurement"]
COLUMNS = [
    "deformation_mm",
    "temperature_C",
    "direction",
    *(f"{band}_{end}_N" for band in BANDS for end in ("lo", "median", "hi")),
    "tested",
    "usable",
]


def test_the_folder_holds_what_it_should(calibrated: Calibrated):
    _, folder = calibrated
    assert {path.name for path in folder.iterdir()} == {
        "posterior.nc",
        "bands.csv",
        "calibration.svg",
        "calibration.png",
        "report.html",
        "summary.json",
        "hdcal-result.json",
    }
    assert [path.name for path in folder.parent.iterdir()] == ["result"]
    assert (folder / "calibration.png").read_bytes().startswith(b"\x89PNG")
    ElementTree.parse(folder / "calibration.svg")


def test_the_summary_obeys_its_schema_and_is_what_json_prints(calibrated: Calibrated):
    done, folder = calibrated
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    obeys(summary, Calibration)
    assert json.loads(done.stdout) == summary
    assert "influence coefficient K" in done.stderr
    assert summary["headline"] in " ".join(done.stderr.split())
    assert 195 < summary["stiffness_N_per_mm"]["median"] < 220


def test_the_bands_are_ordered_and_marked(calibrated: Calibrated):
    with (calibrated[1] / "bands.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [*rows[0]] == COLUMNS
    for row in rows:
        for band in ("physics", "new_measurement"):
            ends = [float(row[f"{band}_{end}_N"]) for end in ("lo", "median", "hi")]
            assert ends == sorted(ends)
        assert row["with_gap_lo_N"] == ""
        tested = 0.02 <= float(row["deformation_mm"]) <= 0.54
        assert (row["tested"], row["usable"]) == (str(tested).lower(), "true")


def test_the_report_asks_nothing_of_the_network(calibrated: Calibrated):
    page = (calibrated[1] / "report.html").read_text("utf-8")
    assert not re.findall(r"https?://", page)
    sources = re.findall(
        r"""(?:src|href|srcset|action)\s*=\s*["']([^"']{0,30})""", page
    )
    assert sources and all(s.startswith("data:image/svg+xml;base64,") for s in sources)
    assert not re.search(r"<script[^>]*src|<link|@import|url\(", page, re.I)
    # One script for each figure is data, the other one is allowed by its hash alone.
    assert len(re.findall(r"<script", page)) == 3
    policy = re.search(r'Policy" content="([^"]*)"', page)
    assert policy and "unsafe" not in policy[1] and "script-src 'sha256-" in policy[1]
    for words in ("0.13", "article", "driven by", "SHA-256", "Next step"):
        assert words in page
    assert 'class="banner bad"' not in page


def test_a_failed_calibration_is_marked_everywhere(here: Hdcal, tmp_path: Path):
    done = here("calibrate", XB1, *options(TOO_SHORT), "--out", "result")
    folder, mark = tmp_path / "result", "FAILED — do not use"
    assert done.returncode == 1, done.stderr
    assert "FAILED" in done.stdout
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    obeys(summary, Calibration)
    assert summary["status"] == "failed" and summary["reasons"]
    assert mark in (folder / "calibration.svg").read_text("utf-8")
    page = (folder / "report.html").read_text("utf-8")
    images = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)
    assert len(images) == 3
    assert all(mark in base64.b64decode(image).decode() for image in images)
    with (folder / "bands.csv").open() as stream:
        assert {row["usable"] for row in csv.DictReader(stream)} == {"false"}
    done = here("predict", folder, "--deformation", "0.1", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "failed"


@pytest.mark.thorough
def test_a_rig_without_a_drawing_goes_the_whole_way(here: Hdcal, tmp_path: Path):
    # The loop of the damper leaves correlated residuals, which mix slowly.
    size = options({"warmup": 500, "draws": 1000})
    done = here("calibrate", ROOT / "datasets/slit-damper", *size, "--out", "run")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "run" / "summary.json").read_text())
    obeys(found, Calibration)
    asked = "margin", "run", "--deformation", 5, "--json"
    assert json.loads(here(*asked).stdout)["status"] == "ok"
    for asked in (
        ("design", "--window", "1:2"),
        ("study", "--vary", "radius_mm=1:2:3"),
    ):
        refused = here(asked[0], "run", *asked[1:])
        assert refused.returncode == 2 and "sizes" in refused.stderr
