"""The first hour with files of one's own: seen, drawn, described, begun."""

import io
import json
import sys
import tomllib
from pathlib import Path

import openpyxl
import pytest
from commands import Hdcal
from slices import slice_of

import hdcal as library
from hdcal.cli.here import what_next
from hdcal.data.resources import priors_folder

LOG = "Weg [mm];Kraft [kN]\n" + "".join(f"0,{k}5;0,0{k}1\n" for k in range(1, 8))
SIZES = ["--wall", ".68", "--radius", "40", "--length", "70"]
BEGUN = [*SIZES, "--deformation", "diametral"]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(LOG)
    return path


def test_a_file_alone_is_shown(here: Hdcal, log: Path):
    done = here("check", log)
    assert done.returncode == 0
    assert done.stdout.index("is a spring") < done.stdout.index("theory spring")


class Terminal(io.StringIO):
    """Somebody who answers."""

    def isatty(self) -> bool:
        return True


OPEN = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70\n"


def test_what_the_gear_file_leaves_open_is_asked_on_a_terminal(
    here: Hdcal, log: Path, monkeypatch
):
    (log.parent / "gear.toml").write_text(OPEN + 'material = "steel"\n')
    assumed = "the deformation is radial"
    assert assumed in here("check", log).stdout
    monkeypatch.setattr("sys.stdin", Terminal("diametral\n"))
    # Where nobody sees the question it is not asked.
    assert assumed in here("check", log).stdout
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    done = here("check", log)
    assert done.returncode == 0 and assumed not in done.stdout
    assert "diametral" in done.stdout
    # A program is asked nothing, and is told.
    monkeypatch.setattr("sys.stdin", Terminal(""))
    notes = json.loads(here("check", log, "--json").stdout)["notes"]
    assert any(assumed in note for note in notes)


def test_the_gear_file_it_writes_says_the_same(here: Hdcal, log: Path):
    written = log.parent / "gear.toml"
    assert here("check", log, "--write-gear", written).returncode == 0
    columns = {"deformation": "Weg [mm]", "force": "Kraft [kN]"}
    assert tomllib.loads(written.read_text())["columns"] == columns
    found = json.loads(here("check", log, "--json").stdout)
    assert found["data"]["force_N"] == [11.0, 71.0]
    # Beside a gear file there is no other to write.
    again = here("check", log, "--write-gear", log.parent / "other.toml")
    assert again.returncode == 2 and "--write-gear" in again.stderr
    assert not (log.parent / "other.toml").exists()


def test_a_unit_that_was_stated_stays_in_the_gear_file(here: Hdcal, tmp_path):
    (tmp_path / "log.csv").write_text(LOG.replace("Kraft [kN]", "force_N"))
    asked = ["check", "log.csv", "--column", "force=force_N[kN]", "--json"]
    done = here(*asked, "--write-gear", "gear.toml")
    assert json.loads(done.stdout)["data"]["force_N"] == [11.0, 71.0]
    again = here("check", "log.csv", "--json")
    assert json.loads(again.stdout)["data"]["force_N"] == [11.0, 71.0]


@pytest.mark.parametrize(("ending", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_readings_as_a_picture(here: Hdcal, log: Path, ending, begins):
    picture = log.with_suffix(f".{ending}")
    done = here("check", log, "--plot", picture)
    assert done.returncode == 0
    assert picture.read_bytes().startswith(begins)
    refused = here("check", log, "--plot", picture)
    assert refused.returncode == 2 and "exists already" in refused.stderr
    assert here("check", log, "--plot", picture, "--force").returncode == 0
    other = here("check", log, "--plot", log.with_suffix(".pdf"))
    assert other.returncode == 2
    # What hdcal did not write is never replaced.
    picture.write_text("mine")
    assert here("check", log, "--plot", picture, "--force").returncode == 2
    assert picture.read_text() == "mine"


def test_a_case_is_begun(here: Hdcal, log: Path):
    folder = log.parent / "rig"
    done = here("init", folder, *BEGUN, "--data", log, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["files"] == ["gear.toml", "data.csv"]
    case = library.read_case(folder)
    assert (case.gear.reading, case.gear.theory) == ("diametral", "ring")
    assert float(case.records.force[-1]) == 71.0
    assert (folder / "data.csv").read_bytes() == log.read_bytes()
    again = here("init", folder, *BEGUN)
    assert again.returncode == 2


def test_several_gears_are_a_fleet(here: Hdcal, log: Path):
    header, *rows = log.read_text("utf-8").splitlines()
    one, other = ([f"{row};{name}" for row in rows] for name in "AB")
    log.write_text("\n".join([f"{header};gear", *one, *other]), "utf-8")
    done = here("init", "rig", *BEGUN, "--data", log)
    assert "Next: hdcal fleet rig --out result" in " ".join(done.stderr.split())


def test_sheets_of_a_workbook_become_a_text_that_is_read_without_it(
    here: Hdcal, tmp_path: Path
):
    book = openpyxl.Workbook()
    for name in ("A", "B"):
        sheet = book.create_sheet(name)
        for row in (("Protocol",), (), ("Weg", "Kraft"), ("mm", "N")):
            sheet.append(row)
        for row in range(8):
            sheet.append((0.05 * row, 5.0 * row))
    book.save(tmp_path / "book.xlsx")
    folder = tmp_path / "rig"
    given = (*BEGUN, "--data", tmp_path / "book.xlsx")
    assert here("init", folder, *given).returncode == 2
    assert here("init", folder, *given, "--sheet", "*").returncode == 0
    case = library.read_case(folder)
    assert case.specimen_labels == ("A", "B") and len(case.records.force) == 16
    whole = library.read_case(tmp_path / "book.xlsx", sheet="*")
    assert "row 4 taken for the units of the columns" in " ".join(whole.notes)


def test_columns_that_nobody_would_guess_are_named(here: Hdcal, tmp_path: Path):
    rows = "".join(f"{0.05 * k:.2f},{5 * k}\n" for k in range(8))
    (tmp_path / "log.csv").write_text("a,b\n" + rows)
    given = (*BEGUN, "--data", tmp_path / "log.csv")
    told = here("init", tmp_path / "rig", *given)
    assert told.returncode == 2 and "--column 'force=HEADER[UNIT]'" in told.stderr
    named = ("--column", "deformation=a[mm]", "--column", "force=b[N]")
    assert here("init", tmp_path / "rig", *given, *named).returncode == 0
    assert library.read_case(tmp_path / "rig").records.force[-1] == 35.0
    assert here("init", tmp_path / "later", *BEGUN, *named).returncode == 0
    (tmp_path / "later" / "data.csv").write_text("a,b\n" + rows)
    assert library.read_case(tmp_path / "later").records.force[-1] == 35.0


def test_a_material_of_ones_own_is_found_from_the_new_folder(here: Hdcal, tmp_path):
    text = (priors_folder() / "steel.toml").read_text("utf-8")
    (tmp_path / "my.toml").write_text(text)
    assert here("init", "rig", *BEGUN, "--material", "my.toml").returncode == 0
    (tmp_path / "rig" / "data.csv").write_text(LOG)
    assert here("check", "rig").returncode == 0
    folder = here("init", "other", *BEGUN, "--data", "rig")
    assert folder.returncode == 2


def test_readings_may_lie_in_the_folder_already(here: Hdcal, log: Path):
    assert here("init", log.parent, *BEGUN).returncode == 0
    assert library.read_case(log).gear.reading == "diametral"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (SIZES, "--deformation: is not stated"),
        (["--wall", "50", *BEGUN[2:]], "not thinner than the radius"),
        ([*SIZES, "--deformation", "radiall"], "'radial', 'diametral'"),
        ([*BEGUN, "--data", "nowhere.csv"], "nowhere.csv: does not exist"),
        ([*BEGUN, "--material", "chese"], "unknown material 'chese'"),
        (["--wall", "0,68", *BEGUN[2:]], "'0,68' is no number: write 0.68"),
        (["--wall", "1,000", *BEGUN[2:]], "'1,000' is no number: write it like 20.5"),
        (
            ["--wall", "1,234.5", *BEGUN[2:]],
            "'1,234.5' is no number: write it like 20.5",
        ),
        (
            ["--wall", "abc,def", *BEGUN[2:]],
            "'abc,def' is no number: write it like 20.5",
        ),
        (["--wall", "inf", *BEGUN[2:]], "'inf' is no number: write it like 20.5"),
        ([*BEGUN, "--data", "nowhere.csv", "--column", "force"], "--column: "),
        ([*BEGUN, "--sheet", "A"], "--sheet: is of a workbook"),
    ],
)
def test_nothing_is_begun_with_what_is_wrong(here: Hdcal, tmp_path, given, words):
    done = here("init", tmp_path / "rig", *given)
    assert done.returncode == 2 and words in done.stderr
    assert not (tmp_path / "rig").exists()


def test_a_case_cannot_begin_where_there_is_no_place(here: Hdcal, log: Path):
    within = here("init", log.parent / "no" / "rig", *BEGUN)
    assert within.returncode == 2 and "parent folder" in within.stderr
    onto = here("init", log, *BEGUN)
    assert onto.returncode == 2
    assert log.read_text() == LOG


def test_alone_it_says_what_one_could_do_here(here: Hdcal, log: Path):
    (log.parent / "rig").mkdir()
    (log.parent / "rig" / "data.csv").write_text(LOG)
    (log.parent / "old result").mkdir()
    (log.parent / "old result" / "posterior.nc").write_text("")
    done = here()
    assert done.returncode == 2 and not done.stdout
    said, steps = done.stderr.split("In this folder one could:\n")
    assert "Usage: hdcal" in said and "  hdcal check log.csv\n" in steps
    assert "  hdcal calibrate rig --out result\n" in steps
    assert "  hdcal margin 'old result' " in steps
    empty = log.parent / "rig" / "empty"
    empty.mkdir()
    assert not list(what_next(empty)) and not list(what_next(empty / "gone"))
    for odd in ("x;reboot.csv", "-o.csv"):
        (empty / odd).write_text("")
    said = {*what_next(empty)}
    assert said == {"hdcal check 'x;reboot.csv'", "hdcal check ./-o.csv"}


def test_pages_are_read_in_the_terminal(here: Hdcal):
    listed = here("help").stdout
    assert "own-csv " in listed and "hysteresis" in listed and "schemas" not in listed
    names = [line.split()[0] for line in listed.splitlines()]
    assert len(names) == len({*names}) > 30
    page = here("help", "own-csv").stdout
    assert "hdcal init" in page
    wrong = here("help", "hysteresi")
    assert wrong.returncode == 2


@pytest.mark.parametrize("shell", slice_of(["bash", "zsh", "fish"], ["bash"]))
def test_a_shell_completes(hdcal: Hdcal, shell: str):
    source = hdcal(env={"_HDCAL_COMPLETE": f"{shell}_source"}).stdout
    assert f"_HDCAL_COMPLETE={shell}_complete" in source
    asked = {"_HDCAL_COMPLETE": f"{shell}_complete", "COMP_WORDS": "hdcal cal"}
    done = hdcal(env={**asked, "COMP_CWORD": "cal" if shell == "fish" else "1"})
    assert done.returncode == 0 and "calibrate" in done.stdout, done.stderr
