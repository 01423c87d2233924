"""`hdcal design` and `hdcal study`: JSON, files, page and findings."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from browser import PHONE, look
from commands import XB1, Done, Hdcal
from schema_checks import obeys

from hdcal.design.inverse_design import InverseDesign, inverse_design
from hdcal.design.study import Study, study
from hdcal.design.wave_generator import WaveGenerator, wave_generator
from hdcal.inference.posterior import Posterior
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import joint
from hdcal.prediction.simulate import gear_forces
from hdcal.report.result_folder import write_result
from hdcal.report.saving import MARKER, Target

WALL = "wall_thickness_mm=0.5:0.8"


@pytest.fixture(scope="module")
def run(calibrated: tuple[Done, Path]) -> Path:
    """The folder of a calibration."""
    return calibrated[1]


@pytest.mark.usefixtures("undrawn")
def test_a_spring_is_designed(run: Path, here: Hdcal, tmp_path: Path):
    asked = ["design", run, "--window", "0.38:0.42", "--temperature=-20:80", "--json"]
    done = here(*asked, "--tolerance", "wall_thickness_mm=0.02")
    assert done.returncode == 0, done.stderr
    found, folder = json.loads(done.stdout), tmp_path / "xb1-100-80-design"
    obeys(found, WaveGenerator)
    files = {path.name for path in folder.iterdir()}
    assert files == {"design.json", "report.html", MARKER, "design.svg", "design.png"}
    assert json.loads((folder / "design.json").read_text("utf-8")) == found
    assert (found["schema"], found["kind"]) == ("hdcal.design/1", "wave_generator")
    assert found["interval_kind"] == "equal-tailed predictive interval"
    assert [row["temperature_C"] for row in found["at_temperature"]] == [-20, 20, 80]
    assert "tested were 20 °C" in found["warnings"][0]
    middle = found["at_temperature"][1]["at_middle"]
    assert middle["lo"] < 0.4 * 209 < middle["hi"]
    again = here(*asked)
    assert again.returncode == 2 and "exists already" in again.stderr


@pytest.mark.usefixtures("undrawn")
def test_sizes_are_found(run: Path, here: Hdcal, tmp_path: Path):
    limits = "--limit-force", "0.07 kN", "--limit-stress", "0.3 GPa"
    done = here("design", run, *limits, "--vary", WALL, "--out", "made")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "made" / "design.json").read_text("utf-8"))
    obeys(found, InverseDesign)
    assert found["asked"]["limit_force_N"] == 70.0
    assert found["asked"]["limit_stress_MPa"] == 300.0
    assert found["design"]["force_kept_N"] == pytest.approx(70.0, rel=1e-5)
    assert 0.6 < found["design"]["sizes_mm"]["wall_thickness"] < 0.68


@pytest.mark.usefixtures("undrawn")
def test_a_study_is_a_table(run: Path, here: Hdcal, tmp_path: Path):
    vary = ["--vary", "wall_thickness_mm=0.6:0.76:5", "--vary", "radius_mm=35,40,45"]
    done = here("study", run, *vary)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "xb1-100-80-study"
    table = pd.read_csv(folder / "study.csv")
    found = json.loads((folder / "study.json").read_text("utf-8"))
    obeys(found, Study)
    assert [*found["columns"]] == [*table] and len(table) == 15
    own = table[(table.wall_thickness_mm == 0.68) & (table.radius_mm == 40)].iloc[0]
    # With the bend that these readings leave possible.
    at = Conditions.of(0.4, 20.0, quantity="gear")
    forces = gear_forces(joint(Posterior.load(run)), at)
    assert own.force_median_N == pytest.approx(np.median(forces), rel=1e-3)
    assert f"{own.force_lo_N:.2f} … {own.force_hi_N:.2f}" in done.stdout


@pytest.mark.usefixtures("undrawn")
def test_without_a_run_it_is_prior_only(here: Hdcal, tmp_path: Path):
    gear = XB1 / "gear.toml"
    done = here("study", "--gear", gear, "--vary", "radius_mm=38,42", "--json")
    found = json.loads(done.stdout)
    assert done.returncode == 0 and found["headline"].startswith("Prior only")
    assert found["basis"] == "prior" and (tmp_path / "gear-study").is_dir()


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["design", "RUN"], ["nothing is asked"]),
        (["design", "RUN", "--window", "0.3:0.5", "--limit-force", "7"], ["both ask"]),
        (["design", "--window", "0.3:0.5"], ["RUN: is missing"]),
        (["design", "RUN", "--window", ".3:.5", "--vary", WALL], ["--vary: has no"]),
        (
            ["design", "RUN", "--window", ".3:.5", "--spring-rate", "9:1"],
            ["-rate: 9:1"],
        ),
        (
            ["design", "RUN", "--limit-force", "70 mm", "--vary", "wall_tickness=1:x"],
            ["'70 mm' is not a force", "Did you mean 'wall_thickness_mm'", "LO:HI"],
        ),
        (["design", "nowhere", "--limit-force", "9"], ["there is no such file"]),
        (["study", "RUN"], ["nothing is varied"]),
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


def test_pages_can_be_read_and_names_are_only_text(run: Path, tmp_path: Path):
    posterior = Posterior.load(run)
    name = "<script>alert(1)</script> $x^{$ 谐波"
    gear = replace(posterior.case.gear, name=name)
    posterior = replace(posterior, case=replace(posterior.case, gear=gear))
    sizes = {"wall_thickness_mm": (0.5, 0.8), "radius_mm": (38.0, 45.0)}
    results = {
        "generator": wave_generator(posterior, (0.38, 0.42)),
        "inverse": inverse_design(posterior, sizes, 70.0),
        "study": study(posterior, {"radius_mm": [38, 40, 42]}),
    }
    for result in results.values():
        assert name in result.text() and "&lt;script&gt;alert" in result._repr_html_()
    with Target(str(tmp_path / "out")) as target:
        write_result(results["generator"], target)
    seen = look(tmp_path / "out" / "report.html", tmp_path)
    assert not seen.complaints and not seen.requests
    assert not any(seen.frames[place]["past"] for place in ("phone", "desk"))
    assert seen.frames["phone"]["width"] <= PHONE
