"""The first steps with new files: check, plot, gear file, init, help, completion."""

import json
from pathlib import Path

import openpyxl
import pytest
from commands import Hdcal

import hdcal as library

LOG = "Weg [mm];Kraft [kN]\n" + "".join(f"0,{k}5;0,0{k}1\n" for k in range(1, 8))
SIZES = ["--wall", ".68", "--radius", "40", "--length", "70"]
BEGUN = [*SIZES, "--deformation", "diametral"]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(LOG)
    return path


def test_check_draws_the_readings(here: Hdcal, log: Path):
    assert here("check", log, "--out", log.parent / "look").returncode == 0
    written = {path.name for path in (log.parent / "look").iterdir()}
    assert {"check.json", "report.html", "readings.png"} <= written


def test_init_makes_a_case(here: Hdcal, log: Path):
    folder = log.parent / "rig"
    given = [*BEGUN, "--nominal", "0.9", "--data", log]
    done = here("init", folder, *given, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["files"] == ["gear.toml", "data.csv"]
    case = library.read_case(folder)
    assert (case.gear.reading, case.gear.theory) == ("diametral", "ring")
    assert case.gear.nominal_deformation == 0.9
    assert float(case.records.force[-1]) == 71.0
    assert here("init", folder, *BEGUN).returncode == 2
    # A folder with readings gets its gear file only.
    assert here("init", log.parent, *BEGUN).returncode == 0
    assert library.read_case(log).gear.reading == "diametral"


def test_init_writes_a_sheet_of_a_workbook(here: Hdcal, tmp_path: Path):
    book = openpyxl.Workbook()
    for name in ("A", "B"):
        sheet = book.create_sheet(name)
        for row in (("Protocol",), (), ("Weg", "Kraft"), ("mm", "N")):
            sheet.append(row)
        for row in range(8):
            sheet.append((0.05 * row, 5.0 * row))
    book.save(tmp_path / "book.xlsx")
    given = ("init", tmp_path / "rig", *BEGUN, "--data", tmp_path / "book.xlsx")
    assert here(*given).returncode == 2
    assert here(*given, "--sheet", "B").returncode == 0
    assert len(library.read_case(tmp_path / "rig").records.force) == 8


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            ["--radius", "40"],
            "hdcal: --wall: is missing. State it.\n"
            "hdcal: --length: is missing. State it.\n"
            "hdcal: --deformation: is missing. State it.\n",
        ),
        (["--wall", "50", *BEGUN[2:]], "not less than the radius"),
        ([*SIZES, "--deformation", "radiall"], "'radial', 'diametral'"),
        ([*BEGUN, "--data", "nowhere.csv"], "nowhere.csv: does not exist"),
        ([*BEGUN, "--material", "chese"], "unknown material 'chese'"),
        (["--wall", "0,68", *BEGUN[2:]], "'0,68' is not a valid float"),
        (["--wall", "inf", *BEGUN[2:]], "wall_thickness_mm"),
        ([*BEGUN, "--data", "nowhere.csv", "--column", "force"], "--column: "),
    ],
)
def test_init_refuses_bad_input(here: Hdcal, tmp_path, given, words):
    done = here("init", tmp_path / "rig", *given)
    assert done.returncode == 2 and words in done.stderr
    assert not (tmp_path / "rig").exists()


def test_init_refuses_an_impossible_folder(here: Hdcal, log: Path):
    for folder in (log.parent / "no" / "rig", log):
        assert here("init", folder, *BEGUN).returncode == 2
    assert log.read_text() == LOG


def test_pages_and_completion_in_the_terminal(hdcal: Hdcal, here: Hdcal):
    names = [line.split()[0] for line in here("help").stdout.splitlines()]
    assert {"own-csv", "hysteresis"} <= {*names} and len(names) == len({*names}) > 30
    assert "hdcal init" in here("help", "own-csv").stdout
    assert here("help", "hysteresi").returncode == 2
    asked = {"_HDCAL_COMPLETE": "bash_complete", "COMP_WORDS": "hdcal cal"}
    done = hdcal(env={**asked, "COMP_CWORD": "1"})
    assert done.returncode == 0 and "calibrate" in done.stdout, done.stderr
