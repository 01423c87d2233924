"""`hdcal respond` writes a whole folder, or says everything that is wrong."""

import csv
import json
import re
from pathlib import Path

import pytest
from commands import Hdcal
from moving import still_posterior
from schema_checks import obeys

from hdcal.motion.respond.answer import ResponseAnswer, ResponseWithColumns

SMALL = ["--points", "101", "--draws", "50"]
FORCE = "time_s,force_N\n0.0,0\n0.01,40\n0.02,40\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result folder of a calibration at rest."""
    folder = tmp_path_factory.mktemp("still") / "run"
    folder.mkdir()
    still_posterior().save(folder / "posterior.nc")
    return folder


@pytest.mark.thorough
def test_a_sampled_force_is_answered_with_a_whole_folder(here: Hdcal, run: Path):
    Path("f.csv").write_text(FORCE)
    done = here("respond", run, "--force", "f.csv", *SMALL, "--json")
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    obeys(printed, ResponseWithColumns)
    assert printed["schema"] == "hdcal.response/1"
    assert printed["status"] == "ok"
    out = Path("run-response")
    names = {"response.csv", "response.json", "response.png", "response.svg"}
    names |= {"report.html", "hdcal-result.json"}
    assert {file.name for file in out.iterdir()} == names
    columns = printed.pop("columns")
    assert printed == json.loads((out / "response.json").read_text("utf-8"))
    obeys(printed, ResponseAnswer)
    with (out / "response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == list(columns)
    assert len(rows) == 101
    assert float(rows[50]["force_N"]) == 40.0
    page = (out / "report.html").read_text("utf-8")
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)


@pytest.mark.usefixtures("undrawn")
def test_words_are_for_people_and_units_are_named(here: Hdcal, run: Path):
    given = ["--force", "step", "--amplitude", "40", "--duration", "0.02"]
    known = ["--mass-kg", "0.04", "--damping", "0.003"]
    done = here("respond", run, *given, *known, *SMALL, "--out", "known")
    assert done.returncode == 0, done.stderr
    assert re.search(r"moved mass m +0\.04 .* kg +given", done.stdout)
    again = here("respond", run, *given, *SMALL, "--out", "known")
    assert again.returncode == 2
    assert "--replace" in again.stderr
    assert here("respond", run, *given, *SMALL, "--out", "known", "--replace")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("force_N\n1\n2\n", "no column holds the time"),
        ("time_s,deformation_mm\n0,1\n1,2\n", "no column holds the force"),
        ("time_s,force_N\n0,1\n", "holds 1 rows"),
        ("time_s,force_N\n0,1\n0,2\n", "not later than that of the row before"),
        ("time_s,force_N\n0,one\n1,2\n", "is not a number"),
        ("time_s,force_stone\n0,1\n1,2\n", "unknown unit"),
    ],
)
def test_a_bad_table_is_told(here: Hdcal, run: Path, text: str, words: str):
    Path("f.csv").write_text(text)
    done = here("respond", run, "--force", "f.csv")
    assert done.returncode == 2
    assert words in done.stderr
    assert not Path("run-response").exists()


def test_everything_wrong_is_told_at_once(here: Hdcal, run: Path):
    Path("run-response").mkdir()
    done = here("respond", run, "--force", "gone.csv", "--frequency", "often")
    assert done.returncode == 2
    lines = done.stderr.splitlines()
    assert len(lines) == 3
    assert all(line.startswith("hdcal: ") for line in lines)


def test_a_failed_calibration_gives_nothing(here: Hdcal, tmp_path: Path):
    folder = tmp_path / "failed"
    folder.mkdir()
    still_posterior(usable=False).save(folder / "posterior.nc")
    done = here("respond", folder, "--force", "step", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "failed"
    assert not Path("failed-response").exists()


def test_effects_do_not_go_with_dynamic(here: Hdcal, case: Path):
    given = ["--dynamic", "--effect", "relaxation", "--with-gap", "--constant-noise"]
    done = here("calibrate", case, *given)
    assert done.returncode == 2
    assert done.stderr.count("does not go with --dynamic") == 2
    # A ramp without a clock is no motion.
    done = here("calibrate", case, "--dynamic")
    assert done.returncode == 2
