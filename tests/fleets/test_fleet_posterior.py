"""posterior.nc of a fleet: what is loaded is what was saved, and answers the same."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from commands import Hdcal
from handmade_fleet import CHAINS, DRAWS, handmade
from posteriors import single
from schema_checks import obeys

import hdcal
from hdcal.errors import InputError, NotUsable
from hdcal.fleets.posterior import FleetMargin, FleetPosterior
from hdcal.fleets.result import Fleet
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import FLEET, kind_of

ASKED = ("--deformation", 0.4, "--limit-force", 85)


@pytest.fixture(scope="module")
def fleet() -> Fleet:
    return handmade(deformation=0.4, limit_force=85.0)


@pytest.fixture
def file(fleet: Fleet, tmp_path: Path) -> Path:
    fleet.posterior.save(tmp_path / "posterior.nc")
    return tmp_path / "posterior.nc"


def test_what_is_loaded_is_what_was_saved(fleet: Fleet, file: Path):
    again = hdcal.FleetPosterior.load(file.parent)
    assert again.facts == fleet.posterior.facts
    assert again.facts.largest_mm == 0.5 and again.facts.reach_mm == 40.0
    assert again.draws.keys() == fleet.draws.keys()
    for name, values in fleet.draws.items():
        np.testing.assert_array_equal(again.draws[name], values)
    assert again.margin(0.4, 85.0) == fleet.margin(0.4, 85.0)
    assert kind_of(file) is kind_of(file.parent) is FLEET
    group = again.tree["posterior"]
    assert dict(group.sizes) == {"chain": CHAINS, "draw": DRAWS}
    # Draws of the first chain come first.
    second = fleet.draws["zero"][DRAWS:]
    np.testing.assert_array_equal(group["zero"].sel(chain=1), second)
    ahead = again.tree["predictions"]["stiffness"]
    interval = fleet.next_gear.stiffness_N_per_mm
    assert np.quantile(ahead, 0.975) == pytest.approx(interval.hi)


def edit_draw(file: h5py.File) -> None:
    file["posterior/sigma"][0, 3] *= 1.0 + 1e-15


def edit_facts(file: h5py.File) -> None:
    facts = json.loads(file.attrs["fleet"])
    file.attrs["fleet"] = json.dumps(facts | {"seed": 1})


@pytest.mark.parametrize("edit", [edit_draw, edit_facts])
def test_a_changed_file_is_refused(file: Path, edit):
    with h5py.File(file, "r+") as opened:
        edit(opened)
    with pytest.raises(InputError) as caught:
        FleetPosterior.load(file)
    assert len(caught.value.findings) == 1


def test_other_files_are_refused(file: Path, tmp_path: Path):
    with pytest.raises(InputError, match="of a fleet"):
        Posterior.load(file)
    single().save(tmp_path / "gear.nc")
    with pytest.raises(InputError, match="of a calibration"):
        FleetPosterior.load(tmp_path / "gear.nc")


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        # Read to 0.5 mm on a radius of 40 mm: this is a deformation in µm.
        ({"deformation": 450.0}, "deformation"),
        ({"deformation": 0.4, "limit_force": -1.0}, "limit_force"),
        ({"deformation": 0.4, "content": 0.5}, "content"),
        ({"deformation": 0.4, "confidence": 0.99}, "confidence"),
    ],
)
def test_what_cannot_be_answered_is_refused(fleet: Fleet, asked: dict, name: str):
    with pytest.raises(InputError) as caught:
        fleet.margin(**asked)
    assert [one.file for one in caught.value.findings] == [name]


def test_bounds_of_any_share_with_any_confidence(fleet: Fleet):
    usual = fleet.margin(0.4)
    (one,) = fleet.margin(0.4, content=0.99).bounds
    assert one == usual.bounds[1]
    (less,) = fleet.margin(0.4, content=0.99, confidence=0.9).bounds
    assert one.at_least < less.at_least < less.at_most < one.at_most
    assert not usual.beyond_tested and fleet.margin(0.51).beyond_tested


def test_a_failed_fleet_has_no_margin(tmp_path: Path, here: Hdcal):
    fleet = handmade(failed="the largest R-hat is 1.2", deformation=0.4)
    assert fleet.next_force is None
    fleet.posterior.save(tmp_path / "posterior.nc")
    with pytest.raises(NotUsable, match=r"R-hat is 1\.2"):
        FleetPosterior.load(tmp_path).margin(0.4)
    done = here("margin", "posterior.nc", *ASKED, "--out", "new")
    assert done.returncode == 1 and not (tmp_path / "new").exists()


def test_the_command_gives_the_force_that_the_fleet_gives(
    fleet: Fleet, file: Path, here: Hdcal, tmp_path: Path
):
    done = here("margin", file.parent, *ASKED, "--out", "new", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, FleetMargin)
    force = fleet.to_dict()["next_force"]
    assert {name: answer[name] for name in force} == force
    assert force["probability_exceeded"] and len(force["bounds"]) == 2
    left = {path.name for path in (tmp_path / "new").iterdir()}
    assert {"margin.json", "report.html"} <= left
    done = here("margin", file.parent, *ASKED, "--content", 0.999, "--json")
    (bound,) = json.loads(done.stdout)["bounds"]
    assert bound["content"] == 0.999


def test_options_without_a_meaning_are_refused_at_once(file: Path, here: Hdcal):
    given = {
        "--temperature": "20:30",
        "--given-force": 80,
        "--tolerance": "radius_mm=0.1",
        "--seed": 3,
        "--content": 0.2,
    }
    options = [part for pair in given.items() for part in pair]
    done = here("margin", file, *ASKED, *options, "--certificate", "--out", "new")
    assert done.returncode == 2 and not Path("new").exists()
    lines = done.stderr.splitlines()
    for option in (*given, "--certificate"):
        assert sum(line.startswith(f"hdcal: {option}: ") for line in lines) == 1, option
    assert len(lines) == len(given) + 1
