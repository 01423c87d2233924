"""Everything that is wrong is said at once, in words, with the right exit code."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from commands import MAIN, XB1, Hdcal
from schema_checks import obeys
from slices import slice_of

from hdcal.calibration.check.check import Check
from hdcal.calibration.effects.effects import Effects


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["calibrate", "--help"], ["diagnose", "-h"]],
)
def test_help_is_given_without_heavy_imports(arguments):
    script = (
        "import atexit, sys; from hdcal.__main__ import main;"
        "heavy = {'jax', 'numpy', 'pandas', 'xarray', 'rich', 'jinja2', 'matplotlib'};"
        "atexit.register(lambda: print('loaded', *sorted(heavy & sys.modules.keys())));"
        "main()"
    )
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: hdcal")
    assert done.stdout.splitlines()[-1] == "loaded"


def test_the_version_is_that_of_the_package(hdcal: Hdcal):
    from importlib.metadata import version

    assert hdcal("--version").stdout == f"hdcal {version('hdcal')}\n"


def test_effects_lists_the_whole_library(here: Hdcal):
    from hdcal.physics.registry import EFFECTS

    done = here("effects", "--json")
    found = json.loads(done.stdout)
    obeys(found, Effects)
    assert found["headline"] == f"{len(EFFECTS)} effects can be added to the model."
    listed = found["effects"]
    assert [effect["name"] for effect in listed] == list(EFFECTS)
    assert all(p["unit"] and p["meaning"] for e in listed for p in e["parameters"])
    words = here("effects").stdout
    assert all(name in words for name in EFFECTS)


def test_check_says_what_was_read(here: Hdcal):
    done = here("check", XB1, "--json")
    found = json.loads(done.stdout)
    obeys(found, Check)
    assert found["headline"] == "The input is in order."
    assert done.returncode == 0
    assert found["data"]["rows"] == 14
    assert found["data"]["direction"] == {"loading": 14, "holding": 0, "unloading": 0}
    assert found["effects"]["not_testable"]["coulomb_friction"] == ["unloading"]
    words = here("check", XB1).stdout
    assert "14 loading" in words and "0.02 … 0.54 mm" in words


@pytest.mark.parametrize(
    ("scale", "reading", "plausible"),
    [
        (1.0, "radial", True),
        (1.0, "diametral", True),
        (0.1, "radial", False),
        (0.05, "diametral", False),
        (10.0, "radial", False),
    ],
)
def test_check_doubts_a_stiffness_of_another_unit(
    here: Hdcal, case: Path, scale: float, reading: str, plausible: bool
):
    header, *rows = (case / "data.csv").read_text().splitlines()
    read = [[float(cell) for cell in row.split(",")] for row in rows]
    scaled = [f"{x},{scale * force}" for x, force in read]
    (case / "data.csv").write_text("\n".join([header, *scaled]))
    gear = (case / "gear.toml").read_text()
    (case / "gear.toml").write_text(gear.replace('"radial"', f'"{reading}"'))
    found = json.loads(here("check", case, "--json").stdout)
    assert (found["headline"] == "The input is in order.") == plausible
    assert any("wrong unit" in note for note in found["notes"]) != plausible


def test_bad_input_gives_every_finding_and_no_traceback(here: Hdcal, case: Path):
    rows = (case / "data.csv").read_text().splitlines()
    rows[3], rows[5] = "0.1,many", "inf,23.52"
    (case / "data.csv").write_text("\n".join(rows))
    gear = (case / "gear.toml").read_text().replace("radius_mm", "radius_m")
    (case / "gear.toml").write_text(gear)
    before = set(case.parent.rglob("*"))
    for command in ("check", "calibrate"):
        done = here(command, case)
        assert done.returncode == 2
        assert done.stdout == ""
        lines = done.stderr.splitlines()
        assert all(line.startswith("hdcal: ") for line in lines)
        assert any("row 4" in line and "data.csv" in line for line in lines)
        assert any("row 6" in line for line in lines)
        assert any("radius_mm" in line for line in lines)
    assert set(case.parent.rglob("*")) == before


def test_findings_come_as_json_too(hdcal: Hdcal, tmp_path: Path):
    # In a process of its own: nothing of any library may get between.
    done = hdcal("check", tmp_path / "none.csv", "--json")
    said = json.loads(done.stdout)
    assert done.returncode == 2
    assert said["status"] == "error"
    keys = {"file", "row", "column", "problem", "remedy"}
    assert said["findings"] and all(f.keys() == keys for f in said["findings"])


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["calibrat"],
        ["calibrate"],
        ["calibrate", XB1, "--chains", "many"],
        ["calibrate", XB1, "--draws", "0"],
        ["calibrate", XB1, "--seed", "-1"],
        ["calibrate", XB1, "--theory", "rings"],
        ["calibrate", XB1, "--chains", "1"],
        ["calibrate", XB1, "--column", "force"],
        ["calibrate", XB1, "--column", "force=a[N]", "--column", "force=b[N]"],
        ["calibrate", XB1, "--effect", "coulomb_friction"],
        ["diagnose"],
        ["diagnose", XB1, "--jobs", "0"],
        ["diagnose", XB1, "--seed", "x"],
        ["predict", XB1],
        ["predict", XB1, "--deformation", "0:1"],
        ["predict", XB1, "--deformation", "0:1:0"],
        ["predict", XB1, "--deformation", "0:1:1000000000"],
        ["predict", XB1, "--deformation", "nan"],
        ["predict", XB1, "--deformation", "0.1", "--temperature", "warm"],
        ["predict", XB1, "--deformation", "0.1"],
        ["predict", XB1 / "data.csv", "--deformation", "0.1"],
    ],
)
def test_a_wrong_command_line_is_bad_input(arguments, here: Hdcal, tmp_path: Path):
    done = here(*arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr and not done.stdout
    assert not any(tmp_path.iterdir())
    as_json = here(*arguments, "--json")
    assert as_json.returncode == 2
    assert json.loads(as_json.stdout)["status"] == "error"


def test_a_result_that_cannot_be_written_is_refused_at_once(
    here: Hdcal, tmp_path: Path
):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "notes.txt").write_text("mine")
    for out in ("file", "file/run", "folder", "none/run", "x" * 300, ""):
        # Far too many draws to finish: the refusal has to come before them.
        many = ["--draws", "1000000", "--out", out, "--force"]
        done = here("calibrate", XB1, *many)
        assert done.returncode == 2, out
        assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.rglob("*")) == [
        "file",
        "folder",
        "notes.txt",
    ]


def test_a_text_from_a_file_cannot_steer_the_terminal(here: Hdcal, case: Path):
    gear = (case / "gear.toml").read_text()
    (case / "gear.toml").write_text(gear.replace("XB1-100-80", r"XB1\u001b[31m\u202e"))
    done = here("check", case)
    assert done.returncode == 0
    assert "\x1b" not in done.stdout and "\u202e" not in done.stdout


@pytest.mark.parametrize("asked", slice_of(["effects", "--help"], ["--help"]))
def test_a_reader_that_goes_away_is_no_error(asked):
    read, write = os.pipe()
    os.close(read)
    command = [*MAIN, asked]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has such a device")
@pytest.mark.parametrize(
    ("asked", "code"),
    [(["effects", "--json"], 0), (["effects", "none", "--json"], 2)],
)
@pytest.mark.parametrize("gone", slice_of(["reader", "disk"], ["disk"]))
def test_words_that_reach_nobody_take_no_result_along(asked, code, gone):
    if gone == "disk":
        write = os.open("/dev/full", os.O_WRONLY)
    else:
        read, write = os.pipe()
        os.close(read)
    done = subprocess.run([*MAIN, *asked], stdout=subprocess.PIPE, stderr=write)
    os.close(write)
    assert done.returncode == code
    assert json.loads(done.stdout)["status"] == ("ok" if code == 0 else "error")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has such a device")
@pytest.mark.parametrize("asked", slice_of(["effects", "--help"], ["--help"]))
def test_output_that_cannot_be_written_is_one_line(asked):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*MAIN, asked], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1
    assert done.stderr == "hdcal: the system refused: No space left on device\n"


def test_a_working_directory_that_is_gone_is_said_at_once(tmp_path: Path):
    (tmp_path / "gone").mkdir()
    command = ["sh", "-c", 'rmdir "$PWD"; exec "$@"', "sh", *MAIN, "check", "x.csv"]
    done = subprocess.run(
        command, cwd=tmp_path / "gone", capture_output=True, text=True
    )
    assert done.returncode == 2
    words = "command line: the working directory is gone. Change to one that exists."
    assert done.stderr == f"hdcal: {words}\n"


@pytest.mark.parametrize("name", ["a" * 4096, "a\nb", "a" * 300 + ".csv"])
def test_a_name_that_no_system_takes_is_a_finding(here: Hdcal, name: str):
    done = here("check", name)
    assert done.returncode == 2 and "internal" not in done.stderr


@pytest.mark.thorough
def test_closed_streams_are_no_error():
    script = (
        "import os, sys; os.close(1); os.close(2); os.execv(sys.argv[1], sys.argv[1:])"
    )
    command = [sys.executable, "-c", script, *MAIN]
    assert subprocess.run([*command, "effects"]).returncode == 0
    assert subprocess.run([*command, "effects", "none"]).returncode == 2


def test_a_defect_of_hdcal_is_one_line():
    script = (
        "import hdcal.data.reading as r; from hdcal.__main__ import main\n"
        "def broken(*_, **__): raise ValueError('one\\ntwo')\n"
        "r.read_case = broken; main()"
    )
    command = [sys.executable, "-c", script, "check", str(XB1)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert "internal error (ValueError: one two); please report it" in done.stderr
    environment = {**os.environ, "HDCAL_DEBUG": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert "Traceback" in done.stderr
