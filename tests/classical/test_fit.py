"""`hdcal fit` compares polynomials, in text, JSON, a table, a chart and a folder."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import XB1, Hdcal
from matplotlib.figure import Figure
from schema_checks import obeys

from hdcal.classical.fit import Fits, fit
from hdcal.data.reading import read_case
from hdcal.errors import InputError

PONTIUS = XB1.parent / "nist-pontius"


def test_curves_are_compared_at_a_deformation_and_by_their_aicc():
    found = fit(read_case(PONTIUS), [1, 2], at=1.0)
    plain = found.to_dict()
    obeys(plain, Fits)
    assert [one.model for one in found][::2] == ["c + a ω", "c + a ω + b ω²"]
    assert min(one["aicc_over_best"] for one in plain["fits"]) == 0.0
    line, _, top, _ = plain["fits"]
    assert line["held_out_runs_N"] > top["held_out_runs_N"]
    force = np.polyval(top["polyfit_order"], 1.0)
    assert top["at"]["force_N"] == pytest.approx(force, rel=1e-12)
    assert top["coefficients"][2]["unit"] == "N/mm^2"
    assert found.headline.startswith(f"{top['model']} has the smallest AICc")
    frame = found.to_frame()
    assert frame.at_force_N[2] == top["at"]["force_N"]
    assert list(frame.lack_of_fit_p_value) == [
        one["lack_of_fit"]["p_value"] for one in plain["fits"]
    ]
    axes = found.plot(Figure().add_subplot())
    assert axes.get_ylabel() == "force as read [N]"


def test_notes_name_what_no_curve_includes():
    thermal = fit(read_case(XB1.parent / "thermal-demo"))
    assert "from 20 to 80 °C" in thermal.notes[0]
    assert "2 runs" in " ".join(fit(read_case(PONTIUS)).notes)
    up = np.linspace(0.0, 0.5, 26)
    x = np.concatenate([up, up[-2::-1]])
    force = 100.0 * x + 0.9 * np.where(np.arange(51) < 26, 1.0, -1.0)
    force += 0.05 * np.random.default_rng(0).normal(size=51)
    loop = fit(read_case({"deformation_mm": x, "force_N": force}))
    assert loop.loop_N == pytest.approx(1.8, abs=0.05) and loop.part == "part"
    assert any("1.8 N counts as scatter" in note for note in loop.notes)


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        ([0], "0 does not lie between 1 and 9"),
        ([1, 10], "10 does not lie between 1 and 9"),
        ([], "is empty"),
    ],
)
def test_degrees_out_of_range_are_refused(degrees, words):
    with pytest.raises(InputError, match=words):
        fit(read_case(XB1), degrees)


def test_text_and_json_hold_the_same_numbers(here: Hdcal):
    words = here("fit", XB1)
    assert words.returncode == 0
    assert "polyval([209.409 -4.24676], w)" in words.stdout
    done = here("fit", XB1, "--json")
    found = json.loads(done.stdout)
    assert (found["schema"], found["status"]) == ("hdcal.fit/1", "ok")
    assert found["fits"][0]["polyfit_order"] == pytest.approx([209.409, -4.24676], 1e-5)
    assert [one["model"] for one in found["fits"][:2]] == ["c + a ω", "a ω"]
    assert found["bayesian"] is None and found["at_mm"] == 0.4
    assert "polyval" in done.stderr


def test_a_folder_holds_page_chart_and_numbers(here: Hdcal, tmp_path: Path):
    out = tmp_path / "fits"
    arguments = ["fit", XB1, "--degree", "2", "--through-origin", "--out", out]
    assert here(*arguments).returncode == 0
    names = {entry.name for entry in out.iterdir()}
    files = {"fit.json", "fit.svg", "fit.png", "report.html"}
    assert names == files | {"hdcal-result.json"}
    page = (out / "report.html").read_text("utf-8")
    assert "a ω + b ω²" in page and "c + a ω</td>" not in page
    assert here(*arguments).returncode == 2
    assert here(*arguments, "--force").returncode == 0


def test_a_calibration_is_compared_with_the_curves(here: Hdcal, calibrated):
    done = here("fit", XB1, "--degree", "1", "--run", calibrated[1], "--json")
    found = json.loads(done.stdout)
    line, other = found["fits"][0], found["bayesian"]
    assert other["interval_kind"] == "equal-tailed credible interval"
    stiffness = other["stiffness_N_per_mm"]
    assert stiffness["lo"] < line["coefficients"][1]["value"] < stiffness["hi"]
    assert other["at"]["lo_N"] < line["at"]["force_N"] < other["at"]["hi_N"]
    assert "credible, predictive" in done.stderr
    refused = here("fit", PONTIUS, "--run", calibrated[1])
    assert refused.returncode == 2
    assert "--run: is a calibration of other data" in refused.stderr


def test_all_bad_input_is_reported_at_once(here: Hdcal, tmp_path: Path):
    done = here("fit", tmp_path / "no.csv", "--degree", "one", "--out", "a/b")
    assert done.returncode == 2 and done.stdout == ""
    assert all(w in done.stderr for w in ("no.csv", "'one' is no list", "a/b"))
    done = here("fit", XB1, "--degree", "1,13", "--json")
    assert json.loads(done.stdout)["findings"][0]["file"] == "--degree"
    assert here("fit", XB1, "--at", "400").returncode == 2
    assert here("fit", XB1, "--at", "nan").returncode == 2
    assert here("fit", XB1, "--run", tmp_path).returncode == 2
