"""`hdcal design` and `hdcal study` answer in words, JSON, files and a page."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from browser import PHONE, look
from commands import XB1, Done, Hdcal
from results import write_result
from schema_checks import obeys

from hdcal.data.gear import read_gear
from hdcal.design.answer import GeneratorAnswer, InverseAnswer
from hdcal.design.inverse_design import inverse_design
from hdcal.design.study.answer import StudyAnswer
from hdcal.design.study.study import study
from hdcal.design.study.summary import study_report
from hdcal.design.summary import generator_report, inverse_report
from hdcal.design.wave_generator import wave_generator
from hdcal.inference.checks import Check
from hdcal.inference.posterior import Posterior
from hdcal.report.answer import Answer
from hdcal.report.saving import MARKER

WALL = "wall_thickness_mm=0.5:0.8"
FIGURES = {"design.svg", "design.png", "profile.svg", "profile.png"}


@pytest.fixture(scope="module")
def run(calibrated: tuple[Done, Path]) -> Path:
    """The folder of a calibration."""
    return calibrated[1]


def valid(text: str, answer: type[Answer]) -> dict:
    """Return an answer that keeps what its schema promises."""
    found = json.loads(text)
    obeys(found, answer)
    return found


@pytest.fixture(scope="module")
def folders(run: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A result of each kind, with a gear whose name is not to be trusted."""
    base = tmp_path_factory.mktemp("designs")
    posterior = Posterior.load(run)
    name = "<script>alert(1)</script> $x^{$ 谐波"
    gear = replace(posterior.case.gear, name=name)
    posterior = replace(posterior, case=replace(posterior.case, gear=gear))
    sizes = {"wall_thickness_mm": (0.5, 0.8), "radius_mm": (38.0, 45.0)}
    spring = wave_generator(posterior, (0.38, 0.42))
    write_result(generator_report(spring), base / "generator")
    among = ["40CrNiMoA", "Ti-6Al-4V"]
    made = inverse_design(posterior, sizes, 70.0, materials=among)
    write_result(inverse_report(made), base / "inv")
    vary = {"wall_thickness_mm": [0.6, 0.7], "radius_mm": [38, 40, 42]}
    tabulated = study(posterior, vary, materials=among)
    write_result(study_report(tabulated), base / "study")
    return {name: base / name for name in ("generator", "inv", "study")}


@pytest.mark.usefixtures("undrawn")
def test_a_spring_is_designed(run: Path, here: Hdcal, tmp_path: Path):
    asked = ["design", run, "--window", "0.38:0.42", "--temperature=-20:80", "--json"]
    done = here(*asked, "--tolerance", "wall_thickness_mm=0.02")
    assert done.returncode == 0, done.stderr
    said = valid(done.stdout, GeneratorAnswer)
    folder = tmp_path / "xb1-100-80-design"
    files = {path.name for path in folder.iterdir()}
    assert files == {"design.json", "report.html", MARKER, *FIGURES}
    assert json.loads((folder / "design.json").read_text("utf-8")) == said
    assert (said["schema"], said["kind"]) == ("hdcal.design/1", "wave_generator")
    assert said["spring"]["probability"] >= 0.99
    assert said["interval_kind"] == "equal-tailed predictive interval"
    assert [row["temperature_C"] for row in said["at_temperature"]] == [-20, 20, 80]
    assert "tested were 20 °C" in said["warnings"][0]
    assert "K is carried over" in done.stderr and "one tested gear" in done.stderr
    force = said["set_point"]["force_N"]
    assert force["lo"] < 0.4 * 209 < force["hi"]
    assert "N/mm keeps the gear within 0.38 … 0.42 mm" in said["headline"]
    assert said["next_step"].startswith("Set the free end of a spring of ")
    assert said["asked"]["tolerances_mm"] == {"wall_thickness_mm": 0.02}
    page = (folder / "report.html").read_text("utf-8")
    assert "wall thickness mm 0.02" in page.partition("What was asked")[2]


@pytest.mark.usefixtures("undrawn")
def test_sizes_are_found(run: Path, here: Hdcal, tmp_path: Path):
    out = tmp_path / "made"
    done = here(
        *("design", run, "--limit-force", "0.07 kN", "--vary", WALL),
        *("--limit-stress", "0.3 GPa", "--out", out),
    )
    assert done.returncode == 0, done.stderr
    said = valid((out / "design.json").read_text("utf-8"), InverseAnswer)
    assert said["answer"][0].startswith(said["headline"])
    assert said["asked"]["limit_force_N"] == 70.0
    assert said["asked"]["limit_stress_MPa"] == 300.0
    assert said["design"]["force_N"]["kept"] == pytest.approx(70.0, rel=1e-5)
    assert 0.6 < said["design"]["sizes_mm"]["wall_thickness"] < 0.68
    assert "needs at most 70 N at 0.4 mm" in done.stdout
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
    own = next(
        r for r in rows if (r["wall_thickness_mm"], r["radius_mm"]) == ("0.68", "40")
    )
    force = [float(own[f"force_{part}_N"]) for part in ("lo", "median", "hi")]
    draws = Posterior.load(run).draws["stiffness"] * 0.4
    assert force[1] == pytest.approx(sorted(draws)[len(draws) // 2], rel=1e-3)
    assert force[0] < force[1] < force[2]
    told = valid((folder / "study.json").read_text("utf-8"), StudyAnswer)
    assert told["interval_kind"] == "equal-tailed credible interval"
    assert told["headline"] == told["answer"][0] and told["next_step"] is None
    (row,) = re.findall(r"^ .* 0\.68 +40 .*$", done.stdout, re.MULTILINE)
    assert f"{force[1]:.2f}" in row and f"{force[0]:.2f} … {force[2]:.2f}" in row


def test_without_a_run_it_is_prior_only(here: Hdcal, tmp_path: Path):
    out = tmp_path / "prior"
    gear = XB1 / "gear.toml"
    done = here("study", "--gear", gear, "--vary", "radius_mm=38,42", "--out", out)
    assert done.returncode == 0, done.stderr
    first, headline = done.stdout.splitlines()[:2]
    assert first == "XB1-100-80: Study, theory “ring”."
    assert headline.startswith("Prior only, no gear was measured: 2 designs")
    told = valid((out / "study.json").read_text("utf-8"), StudyAnswer)
    assert told["headline"].startswith("Prior only")
    assert told["basis"] == "prior"
    assert told["interval_kind"] == "equal-tailed prior interval"
    page = (out / "report.html").read_text("utf-8")
    assert "No gear was measured." in page


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
        (["design", "RUN", "--window", "0.4:0.3"], ["0.4:0.3 is empty"]),
        (["design", "RUN", "--window", "0.4"], ["'0.4' is not LO:HI"]),
        (
            ["design", "RUN", "--window", ".3:.5", "--vary", WALL],
            ["--vary: has no meaning with --window"],
        ),
        (
            ["design", "RUN", "--limit-force", "70 mm", "--vary", "wall_tickness=1:x"],
            ["'70 mm' is not a force", "Did you mean 'wall_thickness_mm'", "LO:HI"],
        ),
        (
            [
                "design",
                "RUN",
                "--limit-force",
                "7",
                "--vary",
                "wall_thickness_mm=.5:.6",
            ],
            ["no wall thickness between 0.5 and 0.6 mm meets 7 N at 0.4 mm"],
        ),
        (
            ["design", "nowhere", "--limit-force", "x", "--vary", WALL],
            ["there is no such file", "'x' is no number"],
        ),
        (["study", "RUN"], ["nothing is varied"]),
        (["study", "RUN", "--vary", "radius=1,2"], ["Did you mean 'radius_mm'"]),
        (["study", "RUN", "--vary", "radius_mm=a"], ["neither start:stop:count"]),
        (["study", "RUN", "--vary", "radius_mm"], ["is not NAME=…"]),
        (
            ["study", "RUN", "--vary", "radius_mm=38", "--vary", "radius_mm=39"],
            ["given twice"],
        ),
        (
            ["study", "RUN", "--vary", "wall_thickness_mm=60", "--material", "stel"],
            ["not thinner than the radius", "Did you mean 'steel'"],
        ),
        (
            ["study", "RUN", "--vary", "radius_mm=38", "--deformation", "3 N"],
            ["is not a length"],
        ),
    ],
)
def test_bad_input_is_told_and_nothing_written(
    run: Path, here: Hdcal, tmp_path: Path, asked: list[str], words: list[str]
):
    done = here(*(run if text == "RUN" else text for text in asked))
    assert done.returncode == 2, done.stdout
    assert all(part in done.stderr for part in words), done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
@pytest.mark.usefixtures("undrawn")
def test_the_longest_table_is_cut_and_says_so(folders: dict[str, Path]):
    gear = read_gear(XB1 / "gear.toml")
    many = study(gear, {"wall_thickness_mm": [0.6 + 1e-4 * i for i in range(201)]})
    told = study_report(many)
    write_result(told, folders["study"].parent / "many")
    page = (folders["study"].parent / "many" / "report.html").read_text("utf-8")
    assert page.count("<tr>") == 200 + 2
    assert "The same in all: material 40CrNiMoA, deformation 0.4 mm, " in page
    assert "The first 40 of 201" in page and "The first 200 of 201" in page
    assert len(told.answer.columns["material"]) == 201
    brief = [section for section in told.document.sections if section.brief]
    assert [len(block.rows) for block in brief[0].blocks[1:2]] == [40]


def test_a_notebook_shows_what_a_design_comes_to():
    gear = read_gear(XB1 / "gear.toml")
    vary = {"wall_thickness_mm": (0.2, 0.8)}
    for found, words in (
        (wave_generator(gear, (0.2, 0.6), probability=0.5), "keeps the gear within"),
        (inverse_design(gear, vary, 90.0, probability=0.5), "needs at most 90 N"),
        (study(gear, {"radius_mm": [38, 40]}), "2 designs, varying radius"),
    ):
        shown = found._repr_html_()
        assert "Prior only" in shown and words in shown
        assert "<html" not in shown


@pytest.mark.usefixtures("undrawn")
def test_what_keeps_its_limits_as_tested_needs_no_change(
    run: Path, here: Hdcal, tmp_path: Path
):
    done = here("design", run, "--limit-force", "300", "--vary", WALL, "--json")
    assert done.returncode == 0, done.stderr
    told = valid(done.stdout, InverseAnswer)
    assert told["next_step"].startswith("No change is needed")
    page = (tmp_path / "xb1-100-80-design" / "report.html").read_text("utf-8")
    assert page.count("<td>40CrNiMoA</td>") == 1
    strength = told["design"]["yield_MPa"]["median"]
    shown = page.partition("limit stress [MPa]</dt><dd>")[2]
    assert float(shown.partition(",")[0].partition(" ")[0]) == pytest.approx(strength)
    assert "the yield strength" in shown.partition("</dd>")[0]


def test_names_are_only_text(folders: dict[str, Path]):
    for folder in folders.values():
        page = (folder / "report.html").read_text("utf-8")
        assert "<script" not in page
        assert "&lt;script&gt;alert(1)" in page
        for image in folder.glob("*.svg"):
            tags = {e.tag.rpartition("}")[2] for e in ElementTree.parse(image).iter()}
            assert not tags & {"script", "foreignObject", "a"}


@pytest.mark.parametrize("kind", ["generator", "inv", "study"])
def test_the_page_can_be_read_in_a_browser(folders, kind: str, tmp_path: Path):
    seen = look(folders[kind] / "report.html", tmp_path)
    assert not seen.complaints and not seen.requests
    for place in ("phone", "desk", "paper"):
        assert not seen.frames[place]["past"]
        assert all(image["natural"] > 0 for image in seen.frames[place]["images"])
    assert seen.frames["phone"]["width"] <= PHONE
