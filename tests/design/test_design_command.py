"""`hdcal design` and `hdcal study`: JSON, files, page and findings."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from browser import PHONE, look
from commands import XB1, Done, Hdcal
from schema_checks import obeys
from slices import slice_of

from hdcal.data.gear import read_gear
from hdcal.design.inverse_design.inverse_design import InverseDesign, inverse_design
from hdcal.design.study.study import Study, study
from hdcal.design.wave_generator.wave_generator import WaveGenerator, wave_generator
from hdcal.inference.checks import Check
from hdcal.inference.posterior import Posterior
from hdcal.report.result import Result
from hdcal.report.result_folder import write_result
from hdcal.report.saving import MARKER, Target

WALL = "wall_thickness_mm=0.5:0.8"
FIGURES = {"design.svg", "design.png", "profile.svg", "profile.png"}


@pytest.fixture(scope="module")
def run(calibrated: tuple[Done, Path]) -> Path:
    """The folder of a calibration."""
    return calibrated[1]


def valid(text: str, result: type[Result]) -> dict:
    """Return an answer that obeys its schema."""
    found = json.loads(text)
    obeys(found, result)
    return found


@pytest.mark.usefixtures("undrawn")
def test_a_spring_is_designed(run: Path, here: Hdcal, tmp_path: Path):
    asked = ["design", run, "--window", "0.38:0.42", "--temperature=-20:80", "--json"]
    done = here(*asked, "--tolerance", "wall_thickness_mm=0.02")
    assert done.returncode == 0, done.stderr
    found = valid(done.stdout, WaveGenerator)
    folder = tmp_path / "xb1-100-80-design"
    files = {path.name for path in folder.iterdir()}
    assert files == {"design.json", "report.html", MARKER, *FIGURES}
    assert json.loads((folder / "design.json").read_text("utf-8")) == found
    assert (found["schema"], found["kind"]) == ("hdcal.design/1", "wave_generator")
    assert found["spring"]["probability"] >= 0.99
    assert found["interval_kind"] == "equal-tailed predictive interval"
    assert [row["temperature_C"] for row in found["at_temperature"]] == [-20, 20, 80]
    assert "tested were 20 °C" in found["warnings"][0]
    assert found["asked"]["tolerances_mm"] == {"wall_thickness_mm": 0.02}
    assert len(found["answer"]) == 5 and found["headline"] in " ".join(
        done.stderr.split()
    )
    force = found["set_point"]["force_N"]
    assert force["lo"] < 0.4 * 209 < force["hi"]
    page = (folder / "report.html").read_text("utf-8")
    assert "wall thickness ± 0.02 mm" in page.partition("Request")[2]


@pytest.mark.usefixtures("undrawn")
def test_sizes_are_found(run: Path, here: Hdcal, tmp_path: Path):
    out = tmp_path / "made"
    done = here(
        *("design", run, "--limit-force", "0.07 kN", "--vary", WALL),
        *("--limit-stress", "0.3 GPa", "--out", out),
    )
    assert done.returncode == 0, done.stderr
    found = valid((out / "design.json").read_text("utf-8"), InverseDesign)
    assert {path.name for path in out.iterdir()} >= FIGURES
    assert found["answer"][0] == found["headline"]
    assert found["asked"]["limit_force_N"] == 70.0
    assert found["asked"]["limit_stress_MPa"] == 300.0
    assert found["design"]["force_N"]["kept"] == pytest.approx(70.0, rel=1e-5)
    assert 0.6 < found["design"]["sizes_mm"]["wall_thickness"] < 0.68
    assert found["next_step"]
    again = here("design", run, "--window", "0.3:0.5", "--out", out)
    assert again.returncode == 2 and "exists already" in again.stderr


@pytest.mark.usefixtures("undrawn")
def test_a_study_is_a_table(run: Path, here: Hdcal, tmp_path: Path):
    vary = ["--vary", "wall_thickness_mm=0.6:0.76:5", "--vary", "radius_mm=35,40,45"]
    done = here("study", run, *vary)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "xb1-100-80-study"
    names = {path.name for path in folder.iterdir()}
    files = {"study.csv", "study.json", "study.svg", "study.png", "report.html"}
    assert names == files | {MARKER}
    with (folder / "study.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 15
    sizes = "wall_thickness_mm", "radius_mm"
    (own,) = (row for row in rows if [row[n] for n in sizes] == ["0.68", "40"])
    force = [float(own[f"force_{part}_N"]) for part in ("lo", "median", "hi")]
    stiffness = Posterior.load(run).draws["stiffness"]
    assert force[1] == pytest.approx(0.4 * np.median(stiffness), rel=1e-3)
    assert force[0] < force[1] < force[2]
    found = valid((folder / "study.json").read_text("utf-8"), Study)
    assert [*found["columns"]] == [*rows[0]]
    assert found["interval_kind"] == "equal-tailed credible interval"
    assert found["headline"] == found["answer"][0] and found["next_step"] is None
    (row,) = re.findall(r"^ *0\.68 +40 .*$", done.stdout, re.MULTILINE)
    assert f"{force[1]:.2f}" in row and f"{force[0]:.2f} … {force[2]:.2f}" in row


@pytest.mark.usefixtures("undrawn")
def test_without_a_run_it_is_prior_only(here: Hdcal, tmp_path: Path):
    out = tmp_path / "prior"
    gear = XB1 / "gear.toml"
    done = here("study", "--gear", gear, "--vary", "radius_mm=38,42", "--out", out)
    assert done.returncode == 0, done.stderr
    found = valid((out / "study.json").read_text("utf-8"), Study)
    for words in (found["headline"], found["assumptions"][0]):
        assert words.startswith("Prior only")
    assert found["basis"] == "prior"
    assert found["interval_kind"] == "equal-tailed prior interval"


@pytest.mark.usefixtures("undrawn")
def test_a_gear_that_keeps_its_limits_needs_no_change(
    run: Path, here: Hdcal, tmp_path: Path
):
    done = here("design", run, "--limit-force", "300", "--vary", WALL, "--json")
    assert done.returncode == 0, done.stderr
    found = valid(done.stdout, InverseDesign)
    assert found["design"]["change"] == 0.0
    page = (tmp_path / "xb1-100-80-design" / "report.html").read_text("utf-8")
    assert page.count("<td>40CrNiMoA</td>") == 1


def test_a_failed_calibration_gives_no_design(run: Path, here: Hdcal, tmp_path: Path):
    posterior = Posterior.load(run)
    bad = Check("R-hat", "failed", "it is 1.2")
    posterior = replace(posterior, checks=(bad,))
    (tmp_path / "failed").mkdir()
    posterior.save(tmp_path / "failed" / "posterior.nc")
    for asked in (
        ["design", "failed", "--window", "0.38:0.42"],
        ["design", "failed", "--limit-force", "70", "--vary", WALL],
        ["study", "failed", "--vary", "radius_mm=38,40"],
    ):
        done = here(*asked)
        assert done.returncode == 1
        assert "must not be used" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["failed"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["design", "RUN"], ["nothing is asked"]),
        (["design", "RUN", "--window", "0.3:0.5", "--limit-force", "7"], ["both ask"]),
        (["design", "--window", "0.3:0.5"], ["RUN: is missing"]),
        (["design", "RUN", "--gear", "g.toml", "--window", ".3:.5"], ["given both"]),
        (["design", "RUN", "--window", "0.4"], ["'0.4' is not LO:HI"]),
        (["design", "RUN", "--window", ".3:.5", "--vary", WALL], ["--vary: has no"]),
        (
            ["design", "RUN", "--limit-force", "70 mm", "--vary", "wall_tickness=1:x"],
            ["'70 mm' is not a force", "Did you mean 'wall_thickness_mm'", "LO:HI"],
        ),
        (
            ["design", "nowhere", "--limit-force", "x", "--vary", WALL],
            ["there is no such file", "'x' is no number"],
        ),
        (["study", "RUN"], ["nothing is varied"]),
        (["study", "RUN", "--vary", "radius_mm=a"], ["neither start:stop:count"]),
        (["study", "RUN", "--vary", "radius_mm"], ["is not NAME=…"]),
        (
            ["study", "RUN", "--vary", "wall_thickness_mm=60", "--material", "stel"],
            ["not thinner than the radius", "Did you mean 'steel'"],
        ),
    ],
)
def test_bad_input_is_refused_and_nothing_written(
    run: Path, here: Hdcal, tmp_path: Path, asked: list[str], words: list[str]
):
    done = here(*(run if text == "RUN" else text for text in asked))
    assert done.returncode == 2, done.stdout
    assert all(part in done.stderr for part in words), done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "kind", slice_of(["generator", "inverse", "study"], ["generator"])
)
def test_pages_can_be_read_and_names_are_only_text(run: Path, tmp_path: Path, kind):
    posterior = Posterior.load(run)
    name = "<script>alert(1)</script> $x^{$ 谐波"
    gear = replace(posterior.case.gear, name=name)
    posterior = replace(posterior, case=replace(posterior.case, gear=gear))
    sizes = {"wall_thickness_mm": (0.5, 0.8), "radius_mm": (38.0, 45.0)}
    among = ["40CrNiMoA", "Ti-6Al-4V"]
    vary = {"wall_thickness_mm": [0.6, 0.7], "radius_mm": [38, 40, 42]}
    result = {
        "generator": lambda: wave_generator(posterior, (0.38, 0.42)),
        "inverse": lambda: inverse_design(posterior, sizes, 70.0, materials=among),
        "study": lambda: study(posterior, vary, materials=among),
    }[kind]()
    assert name in result.text() and "&lt;script&gt;alert" in result._repr_html_()
    with Target(str(tmp_path / kind)) as target:
        write_result(result, target)
    page = tmp_path / kind / "report.html"
    assert "&lt;script&gt;alert(1)" in page.read_text("utf-8")
    for image in (tmp_path / kind).glob("*.svg"):
        tags = {e.tag.rpartition("}")[2] for e in ElementTree.parse(image).iter()}
        assert not tags & {"script", "foreignObject", "a"}
    seen = look(page, tmp_path)
    assert not seen.complaints and not seen.requests
    assert not any(seen.frames[place]["past"] for place in ("phone", "desk"))
    assert seen.frames["phone"]["width"] <= PHONE


def test_a_long_study_is_cut():
    gear = read_gear(XB1 / "gear.toml")
    many = study(gear, {"wall_thickness_mm": [0.6 + 1e-4 * i for i in range(201)]})
    assert len(many.to_frame()) == 201
    assert "The first 100 of 201 designs" in many.text()
    assert many.page().count("<tr>") == 101
    assert "deformation 0.4 mm" in many.text()
