"""Commands print results to standard output and have the documented exit codes."""

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from commands import MAIN, XB1, Hdcal
from schema_checks import obeys

from hdcal.calibration.check.check import CaseCheck
from hdcal.calibration.effects.effects import Effects
from hdcal.physics.registry import EFFECTS

HELP = (
    "import atexit, sys; from hdcal.__main__ import main;"
    "heavy = {'jax', 'numpy', 'pandas', 'xarray', 'rich', 'jinja2', 'matplotlib'};"
    "atexit.register(lambda: print('loaded', *sorted(heavy & sys.modules.keys())));"
    "main()"
)
DEFECT = """
import hdcal.data.reading as r
from hdcal.__main__ import main

def broken(*_, **__):
    raise ValueError('one\\ntwo')

r.read_case = broken
main()
"""


def run(*command, **options) -> subprocess.CompletedProcess[str]:
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run([*map(str, command)], text=True, **options)


def test_help_imports_nothing_heavy():
    done = run(sys.executable, "-c", HELP, "calibrate", "--help")
    assert done.returncode == 0 and done.stdout.startswith("Usage: hdcal calibrate")
    assert done.stdout.splitlines()[-1] == "loaded"


def test_version_effects_and_check(here: Hdcal):
    assert here("--version").stdout == f"hdcal {version('hdcal')}\n"
    effects = json.loads(here("effects", "--json").stdout)
    obeys(effects, Effects)
    assert [effect["name"] for effect in effects["effects"]] == list(EFFECTS)
    done = here("check", XB1, "--json")
    found = json.loads(done.stdout)
    obeys(found, CaseCheck)
    assert (done.returncode, found["data"]["rows"]) == (0, 14)
    assert found["data"]["direction"] == {"loading": 14, "holding": 0, "unloading": 0}
    assert found["effects"]["not_testable"]["coulomb_friction"] == ["unloading"]


@pytest.mark.parametrize(
    ("scale", "reading", "plausible"),
    [(1.0, "diametral", True), (0.1, "radial", False), (10.0, "radial", False)],
)
def test_check_warns_of_an_implausible_stiffness(
    here: Hdcal, case: Path, scale: float, reading: str, plausible: bool
):
    header, *rows = (case / "data.csv").read_text().splitlines()
    read = [[float(cell) for cell in row.split(",")] for row in rows]
    scaled = [f"{x},{scale * force}" for x, force in read]
    (case / "data.csv").write_text("\n".join([header, *scaled]))
    gear = (case / "gear.toml").read_text()
    (case / "gear.toml").write_text(gear.replace('"radial"', f'"{reading}"'))
    notes = json.loads(here("check", case, "--json").stdout)["notes"]
    assert any("Check the unit" in note for note in notes) != plausible


def test_bad_input_gives_every_finding_and_writes_nothing(here: Hdcal, case: Path):
    rows = (case / "data.csv").read_text().splitlines()
    rows[3], rows[5] = "0.1,many", "inf,23.52"
    (case / "data.csv").write_text("\n".join(rows))
    gear = (case / "gear.toml").read_text().replace("radius_mm", "radius_m")
    (case / "gear.toml").write_text(gear)
    before = {*case.parent.rglob("*")}
    for command in ("check", "calibrate"):
        done = here(command, case)
        assert (done.returncode, done.stdout) == (2, "")
        assert all(line.startswith("hdcal: ") for line in done.stderr.splitlines())
        for part in ("data.csv, row 4", "data.csv, row 6", "radius_mm"):
            assert part in done.stderr
    assert {*case.parent.rglob("*")} == before


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["calibrat"],
        ["calibrate", XB1, "--chains", "many"],
        ["calibrate", XB1, "--draws", "0"],
        ["calibrate", XB1, "--column", "force=a[N]", "--column", "force=b[N]"],
        ["calibrate", XB1, "--effect", "coulomb_friction"],
        ["diagnose", XB1, "--jobs", "0"],
        ["predict", XB1, "--deformation", "0:1"],
        ["predict", XB1, "--deformation", "0:1:1000000000"],
        ["predict", XB1, "--deformation", "0.1", "--temperature", "warm"],
        ["predict", XB1 / "data.csv", "--deformation", "0.1"],
        ["check", "a\nb"],
    ],
)
def test_a_wrong_command_line_is_bad_input(arguments, here: Hdcal, tmp_path: Path):
    done = here(*arguments)
    assert done.returncode == 2 and done.stderr and not done.stdout
    assert "Traceback" not in done.stderr and "internal" not in done.stderr
    assert not any(tmp_path.iterdir())
    as_json = json.loads(here(*arguments, "--json").stdout)
    keys = {"file", "row", "column", "problem", "remedy"}
    assert as_json["status"] == "error" and as_json["findings"]
    assert all(finding.keys() == keys for finding in as_json["findings"])


def test_text_of_a_file_sends_no_control_characters(here: Hdcal, case: Path):
    gear = (case / "gear.toml").read_text()
    (case / "gear.toml").write_text(gear.replace("XB1-100-80", r"XB1\u001b[31m\u202e"))
    done = here("check", case)
    assert done.returncode == 0
    assert "\x1b" not in done.stdout and "\u202e" not in done.stdout


def test_a_full_disk_behind_the_output_is_one_line():
    if Path("/dev/full").exists():
        with Path("/dev/full").open("w") as full:
            done = run(*MAIN, "--help", stdout=full, stderr=subprocess.PIPE)
        assert done.returncode == 1 and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("--help | read none", 141),
        ("effects --json | read none", 141),
        ("effects none --json | read none", 2),
        ("effects none 2>&1 | read none", 2),
        ("--frob 2>/dev/full", 2),
        ("--frob 2>&-", 2),
        ("effects none >&- 2>&-", 2),
        ("effects >&-", 0),
        ("effects 2>&-", 0),
    ],
)
def test_output_that_nobody_takes(command: str, code: int):
    command = command.replace("read none", "(exec 0<&-)")
    ended = f'"$@" {command}; exit ${{PIPESTATUS[0]}}'
    done = run("bash", "-c", ended, "bash", *MAIN)
    assert done.returncode == code
    assert "Traceback" not in done.stderr and "internal" not in done.stderr
    # Nothing that belongs to standard error is among the results.
    assert not done.stdout or code == 0


def test_a_defect_of_hdcal_is_one_line_without_debugging():
    command = sys.executable, "-c", DEFECT, "check", XB1
    done = run(*command)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert "internal error (ValueError: one two)" in done.stderr
    assert "Traceback" in run(*command, env={**os.environ, "HDCAL_DEBUG": "1"}).stderr
