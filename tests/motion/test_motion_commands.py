"""`hdcal calibrate --dynamic` and `hdcal respond` as commands."""

import csv
import json
from pathlib import Path

import pytest
from commands import Hdcal
from moving import moving_case, still_posterior, write_moving
from schema_checks import obeys
from short import TOO_SHORT, options

from hdcal.motion.dynamic_calibration import DynamicCalibration
from hdcal.motion.response import Response

SMALL = ["--points", "101", "--draws", "50"]
FORCE = "time_s,force_N\n0.0,0\n0.01,40\n0.02,40\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result folder of a calibration at rest."""
    folder = tmp_path_factory.mktemp("still") / "run"
    folder.mkdir()
    still_posterior().save(folder / "posterior.nc")
    return folder


def test_a_calibration_is_a_whole_folder_also_where_it_failed(here: Hdcal):
    """So few draws fail their checks."""
    folder = write_moving(moving_case(0), Path("released"))
    given = ["--dynamic", folder, "--out", "result", "--json"]
    done = here("calibrate", *given, *options(TOO_SHORT))
    assert done.returncode == 1, done.stderr
    summary = json.loads(done.stdout)
    assert summary == json.loads(Path("result/summary.json").read_text("utf-8"))
    obeys(summary, DynamicCalibration)
    assert summary["schema"] == "hdcal.dynamic-calibration/3"
    names = {"motion.csv", "motion.png", "motion.svg", "posterior.nc", "report.html"}
    names |= {"summary.json", "hdcal-result.json"}
    assert {file.name for file in Path("result").iterdir()} == names
    with open("result/motion.csv") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 200 and {row["usable"] for row in rows} == {"false"}
    assert "FAILED" in Path("result/motion.svg").read_text("utf-8")
    done = here("respond", "result", "--force", "step", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "failed"
    assert not Path("result-response").exists()


def test_a_sampled_force_is_answered_with_a_folder(here: Hdcal, run: Path):
    Path("f.csv").write_text(FORCE)
    asked = ["respond", run, "--force", "f.csv", *SMALL, "--json"]
    done = here(*asked, "--mass-kg", "0.04", "--damping", "0.003")
    assert done.returncode == 0, done.stderr
    printed, out = json.loads(done.stdout), Path("run-response")
    obeys(printed, Response)
    assert printed == json.loads((out / "response.json").read_text("utf-8"))
    mass = printed["estimates"]["mass_kg"]
    assert mass["median"] == pytest.approx(0.04) and mass["driven_by"] == "given"
    assert {"response.svg", "report.html"} < {file.name for file in out.iterdir()}
    with (out / "response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == list(printed["columns"])
    assert len(rows) == 101 and float(rows[50]["force_N"]) == 40.0
    assert here(*asked).returncode == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("force_N\n1\n2\n", "no column contains the time"),
        ("time_s,force_stone\n0,1\n1,2\n", "unknown unit"),
    ],
)
def test_a_bad_table_is_refused(here: Hdcal, run: Path, text: str, words: str):
    Path("f.csv").write_text(text)
    done = here("respond", run, "--force", "f.csv")
    assert done.returncode == 2 and words in done.stderr
    assert not Path("run-response").exists()


def test_options_of_other_models_are_refused(here: Hdcal, case: Path):
    given = ["--dynamic", "--effect", "relaxation", "--with-gap"]
    done = here("calibrate", case, *given)
    assert done.returncode == 2
    assert done.stderr.count("cannot be combined with --dynamic") == 2
    # A ramp without a clock is no motion.
    assert here("calibrate", case, "--dynamic").returncode == 2
