"""`hdcal design` and `hdcal study`: JSON, files and findings."""

import json
from pathlib import Path

import pandas as pd
import pytest
from commands import Hdcal
from posteriors import single
from schema_checks import obeys

from hdcal.design.inverse_design import InverseDesign
from hdcal.design.study import Study
from hdcal.design.wave_generator import WaveGenerator

WALL = "wall_thickness_mm=0.5:0.8"

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a calibration."""
    folder = tmp_path_factory.mktemp("run")
    single(size=2000).save(folder / "posterior.nc")
    return folder


def test_a_spring_is_designed(run: Path, here: Hdcal, tmp_path: Path):
    asked = ["design", run, "--window", "0.38:0.42", "--temperature=-20:80", "--json"]
    done = here(*asked, "--tolerance", "wall_thickness_mm=0.02")
    assert done.returncode == 0, done.stderr
    found, folder = json.loads(done.stdout), tmp_path / "test-design"
    obeys(found, WaveGenerator)
    assert json.loads((folder / "design.json").read_text("utf-8")) == found
    assert {"report.html", "design.svg"} < {path.name for path in folder.iterdir()}
    assert found["asked"]["temperature_C"] == [-20, 20, 80]
    assert found["force_N"][1]["lo"] < 0.4 * 205 < found["force_N"][1]["hi"]
    assert here(*asked).returncode == 2


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


def test_a_study_is_a_table(run: Path, here: Hdcal, tmp_path: Path):
    vary = ["--vary", "wall_thickness_mm=0.6:0.76:5", "--vary", "radius_mm=35,40,45"]
    done = here("study", run, *vary)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "test-study"
    table = pd.read_csv(folder / "study.csv")
    found = json.loads((folder / "study.json").read_text("utf-8"))
    obeys(found, Study)
    assert [*found["columns"]] == [*table] and len(table) == 15


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["design", "RUN"], ["neither is given"]),
        (
            ["design", "RUN", "--window", "0.3:0.5", "--limit-force", "7"],
            ["both are given"],
        ),
        (
            ["design", "RUN", "--window", ".3:.5", "--vary", WALL],
            ["--vary: cannot be combined"],
        ),
        (
            ["design", "RUN", "--limit-force", "70 mm", "--vary", "wall_tickness=1:x"],
            ["'70 mm' is not a force", "Did you mean 'wall_thickness_mm'", "LO:HI"],
        ),
        (["design", "nowhere", "--limit-force", "9"], ["there is no such file"]),
        (["study", "RUN"], ["no size is varied"]),
        (
            ["study", "RUN", "--vary", "wall_thickness_mm=60"],
            ["not less than the radius"],
        ),
    ],
)
def test_bad_input_is_refused_and_nothing_written(
    run: Path, here: Hdcal, tmp_path: Path, asked: list[str], words: list[str]
):
    done = here(*(run if text == "RUN" else text for text in asked))
    assert done.returncode == 2, done.stdout
    assert all(part in done.stderr for part in words), done.stderr
    assert not list(tmp_path.iterdir())
