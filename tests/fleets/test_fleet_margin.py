"""A margin that is asked of a fleet's folder is what the fleet itself tells."""

import json
from dataclasses import replace
from html import escape
from pathlib import Path

import pytest
from commands import Hdcal
from fleets import handmade
from schema_checks import obeys

from hdcal.errors import InputError
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
    assert done.returncode == 1
    assert not (tmp_path / "new").exists()


def test_other_folders_are_told_what_they_are(here: Hdcal, tmp_path: Path):
    left(tmp_path / "fleet")
    done = here("predict", "fleet", "--deformation", 0.4)
    assert done.returncode == 2
    (tmp_path / "fleet" / "posterior.nc").unlink()
    done = here("margin", "fleet", *ASKED)
    assert done.returncode == 2


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


@pytest.mark.parametrize("asked", [450, -450, 60])
def test_a_deformation_of_another_unit_is_refused(here: Hdcal, tmp_path, asked):
    """Read to 0.5 mm on a radius of 40 mm: 450 are µm, and 60 no deformation."""
    left(tmp_path / "fleet")
    done = here("margin", "fleet", "--deformation", asked, "--out", "new")
    words = f"--deformation: {asked} mm, where the readings reach to 0.5 mm. Give it"
    assert done.returncode == 2 and words in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "new").exists()


def test_a_spring_has_no_radius_but_was_read(tmp_path):
    found = handmade()
    radius = found.posterior
    spring = replace(radius, facts=replace(radius.facts, reach_mm=None))
    assert spring.next_force(49.0).beyond_tested
    with pytest.raises(InputError, match="51 mm, where the readings reach"):
        spring.next_force(51.0)
    with pytest.raises(InputError, match="49 mm, where the readings reach"):
        radius.next_force(49.0)


def test_the_fleet_refuses_it_before_it_is_fitted(here: Hdcal, tmp_path: Path):
    records = handmade().case.records
    rows = zip(records.specimen, records.deformation, records.force, strict=True)
    lines = [f"{'ABCD'[gear]},{x},{y + 0.1 * (x > 0.3)}" for gear, x, y in rows]
    text = "\n".join(["specimen,deformation_mm,force_N", *lines])
    (tmp_path / "line.csv").write_text(text)
    done = here("fleet", "line.csv", "--deformation", 450, "--seed", -1)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 2
    assert "--deformation: 450 mm, where the readings reach to 0.5 mm" in done.stderr
    assert not (tmp_path / "line-fleet").exists()


def test_what_is_no_deformation_is_said_once(here: Hdcal, tmp_path: Path):
    left(tmp_path / "fleet")
    done = here("margin", "fleet", "--deformation", "abc")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "--deformation" in done.stderr and "abc" in done.stderr
