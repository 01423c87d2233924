"""A margin that is asked of a fleet's folder is what the fleet itself tells."""

import json
from dataclasses import replace
from html import escape
from pathlib import Path

import pytest
from commands import Hdcal
from fleets import handmade
from schema_checks import obeys

from hdcal.fleets.force.answer import ForceAnswer
from hdcal.fleets.summary import fleet_report
from hdcal.report.write import write_numbers

ASKED = ("--deformation", 0.4, "--limit-force", 85)


def left(folder: Path, **changes) -> dict:
    """Write what a fleet leaves where its force was asked for; return its answer."""
    found = replace(handmade(), **changes)
    needed = None if found.reasons else found.next_force(0.4, 85.0)
    folder.mkdir()
    write_numbers(fleet_report(found, force=needed), folder)
    return json.loads((folder / "summary.json").read_text("utf-8"))


def test_it_is_the_force_that_the_fleet_tells(here: Hdcal, tmp_path: Path):
    told = left(tmp_path / "fleet")["next_force"]
    done = here("margin", "fleet", *ASKED, "--out", "margin", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, ForceAnswer)
    assert {name: answer[name] for name in told} == told
    assert told["probability_exceeded"] is not None and len(told["bounds"]) == 2
    folder = tmp_path / "margin"
    assert json.loads((folder / "next_force.json").read_text("utf-8")) == answer
    names = {path.name for path in folder.iterdir()}
    assert {"report.html", "force.png", "force.svg"} <= names
    page = (folder / "report.html").read_text("utf-8")
    assert escape(answer["headline"]) in page and "from 4 gears, 20 readings" in page
    assert any("say little of how much ordinary ones" in n for n in answer["notes"])


def test_its_bounds_are_of_the_share_and_confidence_asked_for(here, tmp_path):
    left(tmp_path / "fleet")
    asked = ("margin", "fleet", *ASKED, "--json", "--confidence", 0.9)
    both = json.loads(here(*asked).stdout)["bounds"]
    assert [one["content"] for one in both] == [0.9, 0.99]
    assert {one["confidence"] for one in both} == {0.9}
    (one,) = json.loads(here(*asked, "--content", 0.999).stdout)["bounds"]
    assert one["content"] == 0.999 and one["at_most_N"] > both[1]["at_most_N"]


def test_what_a_fleet_does_not_tell_is_refused_all_at_once(here, tmp_path):
    left(tmp_path / "fleet")
    given = {
        "--temperature": "20:30",
        "--given-force": 80,
        "--required-probability": 0.9,
        "--population": "readings",
        "--quantity": "load",
        "--direction": "down",
        "--tolerance": "radius_mm=0.1",
        "--rule": "simple",
        "--seed": 3,
        "--content": 0.2,
    }
    options = [part for pair in given.items() for part in pair]
    done = here("margin", "fleet", *ASKED, *options, "--certificate", "--out", "new")
    assert done.returncode == 2 and not (tmp_path / "new").exists()
    lines = done.stderr.splitlines()
    for option in (*given, "--certificate"):
        assert sum(line.startswith(f"hdcal: {option}: ") for line in lines) == 1, option
    assert len(lines) == len(given) + 1
    # What it tells anyway may be said.
    said = ("--population", "specimens", "--quantity", "reading", "--seed", 0)
    assert here("margin", "fleet", *ASKED, *said).returncode == 0


def test_a_fleet_that_failed_has_no_margin(here: Hdcal, tmp_path: Path):
    check = replace(handmade().checks[0], outcome="failed", words="no chain agrees")
    assert left(tmp_path / "fleet", checks=(check,))["status"] == "failed"
    done = here("margin", "fleet", *ASKED, "--out", "new")
    assert done.returncode == 1 and "no chain agrees" in done.stderr
    assert not (tmp_path / "new").exists()


def test_other_folders_are_told_what_they_are(here: Hdcal, tmp_path: Path):
    left(tmp_path / "fleet")
    done = here("predict", "fleet", "--deformation", 0.4)
    assert done.returncode == 2 and "is of a fleet, which models no" in done.stderr
    (tmp_path / "fleet" / "posterior.nc").unlink()
    done = here("margin", "fleet", *ASKED)
    assert done.returncode == 2
    assert "left by an older hdcal, without a posterior" in done.stderr


@pytest.mark.thorough
def test_the_commands_agree_on_measured_gears(hdcal: Hdcal, tmp_path: Path):
    data = Path(__file__).parents[2] / "datasets" / "fleet-demo"
    done = hdcal("fleet", data, *ASKED, "--seed", 5, "--out", tmp_path / "line")
    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "line" / "summary.json").read_text("utf-8"))
    done = hdcal("margin", tmp_path / "line", *ASKED, "--json")
    answer = json.loads(done.stdout)
    assert {name: answer[name] for name in told["next_force"]} == told["next_force"]
    assert answer["seed"] == 5 and answer["data_sha256"] == told["data_sha256"]


def test_what_is_no_deformation_is_said_once(here: Hdcal, tmp_path: Path):
    left(tmp_path / "fleet")
    done = here("margin", "fleet", "--deformation", "abc")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "--deformation" in done.stderr and "abc" in done.stderr
