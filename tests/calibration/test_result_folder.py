"""`hdcal calibrate` leaves a whole folder that other tools can read."""

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
import xarray as xr
from commands import XB1, Done, Hdcal
from schema_checks import obeys
from short import SHORT, options

from hdcal.calibration.calibration import Calibration
from hdcal.errors import Finding, InputError

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


def read_bands(text: str) -> list[dict]:
    """Return the rows of a table of bands."""
    rows = list(csv.DictReader(text.splitlines()))
    assert list(rows[0]) == COLUMNS
    return rows


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
    assert summary["next_step"] == summary["next_steps"][0]
    assert 195 < summary["stiffness_N_per_mm"]["median"] < 220


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        (("status",), "failed"),
        (("parameters", "K"), None),
        (("parameters", "K", "driven_by"), "hope"),
        (("parameters", "K", "contraction"), 1.5),
        (("parameters", "no name"), "as K"),
        (("K_by_theory",), {}),
        (("checks",), []),
        (("sampling", "chains"), 1),
        (("versions",), {}),
        (("gear", "theory"), "torus"),
        (("data", "sha256"), "abc"),
    ],
)
def test_the_schema_refuses_wrong_values(calibrated: Calibrated, place, wrong):
    summary = json.loads((calibrated[1] / "summary.json").read_text("utf-8"))
    K = summary["parameters"]["K"]
    summary["parameters"]["effect.parameter"] = K
    obeys(summary, Calibration)
    inner = summary
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = K if wrong == "as K" else wrong
    with pytest.raises(jsonschema.ValidationError):
        obeys(summary, Calibration)


def test_the_posterior_opens_as_a_data_tree(calibrated: Calibrated):
    with xr.open_datatree(calibrated[1] / "posterior.nc", engine="h5netcdf") as tree:
        groups = {"posterior", "prior", "sample_stats", "observed_data"}
        assert groups <= set(tree.children)
        assert tree["posterior"]["K"].sizes == {"chain": 4, "draw": 500}


def test_the_bands_are_ordered_and_marked(calibrated: Calibrated):
    rows = read_bands((calibrated[1] / "bands.csv").read_text())
    for row in rows:
        physics = [float(row[f"physics_{end}_N"]) for end in ("lo", "median", "hi")]
        new = [float(row[f"new_measurement_{end}_N"]) for end in ("lo", "median", "hi")]
        assert physics == sorted(physics) and new == sorted(new)
        assert row["with_gap_lo_N"] == ""
        assert (
            row["tested"] == str(0.02 <= float(row["deformation_mm"]) <= 0.54).lower()
        )
        assert row["usable"] == "true"


def test_the_report_asks_nothing_of_the_network(calibrated: Calibrated):
    page = (calibrated[1] / "report.html").read_text("utf-8")
    assert not re.findall(r"https?://", page)
    sources = re.findall(
        r"""(?:src|href|srcset|action)\s*=\s*["']([^"']{0,30})""", page
    )
    assert sources and all(s.startswith("data:image/svg+xml;base64,") for s in sources)
    assert not re.search(r"<script[^>]*src|<link|@import|url\(", page, re.I)
    # One script for each figure is data, the other one is allowed by its hash alone.
    assert len(re.findall(r"<script", page)) == 5
    policy = re.search(r'Policy" content="([^"]*)"', page)
    assert policy and "unsafe" not in policy[1] and "script-src 'sha256-" in policy[1]
    for words in ("0.13", "article", "driven by", "SHA-256", "Next step"):
        assert words in page
    assert 'class="banner bad"' not in page


@pytest.mark.thorough
def test_an_older_result_is_replaced_only_when_told_to(
    calibrated: Calibrated, here: Hdcal
):
    _, folder = calibrated
    before = (folder / "summary.json").read_bytes()
    again = ["calibrate", XB1, *options(SHORT), "--out", folder]
    done = here(*again)
    assert done.returncode == 2
    assert "exists already" in done.stderr and "--force" in done.stderr
    assert (folder / "summary.json").read_bytes() == before
    done = here(*again, "--force")
    assert done.returncode == 0, done.stderr
    assert "Next step" in done.stdout and "\x1b" not in done.stdout
    assert (folder / "summary.json").read_bytes() != before
    assert [path.name for path in folder.parent.iterdir()] == ["result"]


def test_predict_prints_a_table(calibrated: Calibrated, here: Hdcal):
    asked = ["--deformation", "0:0.6:4", "--temperature", "20,60"]
    done = here("predict", calibrated[1], *asked)
    assert done.returncode == 0, done.stderr
    rows = read_bands(done.stdout)
    found = [(float(r["deformation_mm"]), float(r["temperature_C"])) for r in rows]
    expected = [(w, t) for t in (20.0, 60.0) for w in (0.0, 0.2, 0.4, 0.6)]
    np.testing.assert_allclose(found, expected)
    assert "6 of 8 rows" in done.stderr


def test_predict_writes_a_file_or_json(
    calibrated: Calibrated, here: Hdcal, tmp_path: Path
):
    out = tmp_path / "bands.csv"
    asked = ["predict", calibrated[1], "--deformation", "0.1,0.2", "--out", out]
    assert here(*asked).stdout == ""
    assert len(read_bands(out.read_text())) == 2
    refused = here(*asked)
    assert refused.returncode == 2 and "exists already" in refused.stderr
    done = here(*asked, "--force", "--json", "--direction", "down")
    said = json.loads(done.stdout)
    assert said["status"] == "ok" and list(said["columns"]) == COLUMNS
    assert said["columns"]["direction"] == ["down", "down"]
    assert said["columns"]["with_gap_lo_N"] == [None, None]
    assert [path.name for path in tmp_path.iterdir()] == ["bands.csv"]


@pytest.mark.thorough
def test_without_a_writable_cache_it_works_too(
    calibrated: Calibrated, hdcal: Hdcal, tmp_path: Path
):
    (tmp_path / "file").touch()
    asked = ["predict", calibrated[1], "--deformation", "0.1"]
    place = str(tmp_path / "file")
    cache = {"HDCAL_CACHE_DIR": place, "JAX_COMPILATION_CACHE_DIR": place}
    done = hdcal(*asked, env=cache)
    assert done.returncode == 0 and done.stderr == ""


@pytest.mark.parametrize("given", [(), ("--constant-noise",)])
def test_the_noise_may_be_kept_at_one_size(here: Hdcal, case: Path, monkeypatch, given):
    asked = {}

    def refuse(case, **settings):
        asked.update(settings)
        raise InputError([Finding("case", "is not sampled here", "Look at `asked`")])

    monkeypatch.setattr("hdcal.calibration.calibrate.calibrate", refuse)
    assert here("calibrate", case, *given).returncode == 2
    assert asked["adapt_noise"] is not bool(given)
