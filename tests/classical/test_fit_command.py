"""`hdcal fit` gives a curve-fitting tool's numbers, in words, JSON and a report."""

import json
from pathlib import Path

import pytest
from commands import XB1, Hdcal


def test_words_and_json_hold_the_same_numbers(here: Hdcal):
    words = here("fit", XB1)
    assert words.returncode == 0
    assert "polyval([209.409 -4.24676], w)" in words.stdout
    assert "95 % confidence interval" in words.stdout
    done = here("fit", XB1, "--json")
    found = json.loads(done.stdout)
    assert (found["schema"], found["status"]) == ("hdcal.fit/1", "ok")
    assert found["fits"][0]["polyfit_order"] == pytest.approx([209.409, -4.24676], 1e-5)
    assert [one["model"] for one in found["fits"][:2]] == ["c + a ω", "a ω"]
    assert found["bayesian"] is None and found["at_mm"] == 0.4
    assert "polyval" in done.stderr


def test_a_folder_holds_report_figure_and_numbers(here: Hdcal, tmp_path: Path):
    out = tmp_path / "fits"
    arguments = ["fit", XB1, "--degree", "2", "--through-origin", "--out", out]
    assert here(*arguments).returncode == 0
    names = {entry.name for entry in out.iterdir()}
    files = {"fit.json", "fit.svg", "fit.png", "report.html"}
    assert names == files | {"hdcal-result.json"}
    page = (out / "report.html").read_text("utf-8")
    assert "a ω + b ω²" in page and "c + a ω" not in page
    assert here(*arguments).returncode == 2
    assert here(*arguments, "--force").returncode == 0


def test_the_calibration_stands_beside_the_curves(here: Hdcal, calibrated):
    done = here("fit", XB1, "--degree", "1", "--run", calibrated[1], "--json")
    found = json.loads(done.stdout)
    line, other = found["fits"][0], found["bayesian"]
    assert other["interval_kind"] == "equal-tailed credible interval"
    stiffness = other["stiffness_N_per_mm"]
    assert stiffness["lo"] < line["coefficients"][1]["value"] < stiffness["hi"]
    assert other["at"]["lo_N"] < line["at"]["force_N"] < other["at"]["hi_N"]
    assert "credible, predictive" in done.stderr
    pontius = XB1.parent / "nist-pontius"
    refused = here("fit", pontius, "--run", calibrated[1])
    assert refused.returncode == 2
    assert "calibration of other data" in refused.stderr


def test_bad_input_is_said_at_once(here: Hdcal, tmp_path: Path):
    done = here("fit", tmp_path / "no.csv", "--degree", "one", "--out", "a/b")
    assert done.returncode == 2 and done.stdout == ""
    assert all(w in done.stderr for w in ("no.csv", "'one' is no list", "a/b"))
    done = here("fit", XB1, "--degree", "1,13", "--json")
    assert json.loads(done.stdout)["findings"][0]["file"] == "--degree"
    assert here("fit", XB1, "--at", "400").returncode == 2
    assert here("fit", XB1, "--at", "nan").returncode == 2
    assert here("fit", XB1, "--run", tmp_path).returncode == 2
