"""A fleet's population is saved whole; what was changed or failed is refused."""

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from fleets import handmade
from posteriors import single

import hdcal
from hdcal.errors import InputError, NotUsable
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.fleet_posterior import FleetPosterior
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import CALIBRATION, FLEET, content, kind_of

CHANGED = "was changed after hdcal wrote it. Take the file .* run hdcal fleet again"


def with_lots() -> Fleet:
    """Return the fleet made by hand, of two lots."""
    found, rng = handmade(), np.random.default_rng(1)
    case = replace(found.case, lots=("low", "low", "high", "high"))
    first = rng.normal(0.0, 0.01, 400)
    lots = {"lot_1": first, "lot_2": -first, "lot_sd": np.abs(first)}
    draws = {**found.draws, **lots, "lot_ratio": np.ones(400)}
    readings = replace(found.readings, case=case)
    return replace(found, readings=readings, draws=draws, lots=["high", "low"])


@pytest.fixture(scope="module")
def fleet() -> Fleet:
    return with_lots()


@pytest.fixture
def file(fleet: Fleet, tmp_path: Path) -> Path:
    fleet.posterior.save(tmp_path / "posterior.nc")
    return tmp_path / "posterior.nc"


def test_what_is_loaded_is_what_was_saved(fleet: Fleet, file: Path):
    again = hdcal.FleetPosterior.load(file.parent)
    assert again.facts == fleet.posterior.facts and again.facts.lots == ("high", "low")
    assert again.draws.keys() == fleet.draws.keys()
    for name, values in fleet.draws.items():
        np.testing.assert_array_equal(again.draws[name], values)
    ahead = again.tree["predictions"]["stiffness"]
    np.testing.assert_array_equal(ahead.values.ravel(), fleet.next_stiffness)
    assert again.next_force(0.4, 85.0) == fleet.next_force(0.4, 85.0)
    assert "4 gears, 400 draws, usable" in repr(again)
    assert kind_of(file) is kind_of(file.parent) is FLEET
    assert kind_of(file.parents[1]) is None


def test_draws_are_those_of_their_chain_with_their_unit(fleet: Fleet):
    group = fleet.tree["posterior"]
    assert dict(group.sizes) == {"chain": 2, "draw": 200}
    # Draws of the first chain come first.
    second = fleet.draws["zero"][200:]
    np.testing.assert_array_equal(group["zero"].sel(chain=1), second)
    units = {name: group[name].attrs["units"] for name in group.data_vars}
    assert units["stiffness"] == "N/mm" and units["run_offset_sd"] == "N"
    assert units["specimen_sd"] == units["lot_1"] == "1"
    assert group["lot_2"].attrs["long_name"] == "low"


@pytest.mark.thorough
def test_chains_of_the_sampler_come_back_as_they_were():
    rng = np.random.default_rng(4)
    x = np.tile(np.linspace(0.0, 0.5, 9), 5)
    own = np.repeat([198.0, 199.0, 200.0, 201.0, 202.0], 9)
    force = own * x + rng.normal(0.0, 0.3, len(x))
    gear = np.repeat(list("ABCDE"), 9)
    data = {"deformation_mm": x, "force_N": force, "specimen": gear}
    found = hdcal.fleet(data, chains=2, draws=150)
    assert dict(found.tree["posterior"].sizes) == {"chain": 2, "draw": 150}
    assert found.posterior.facts.units.keys() == found.draws.keys()
    assert found.posterior.facts.largest_mm == 0.5


def edit_draw(file: h5py.File) -> None:
    file["posterior/sigma"][0, 3] *= 1.0 + 1e-15


def edit_next(file: h5py.File) -> None:
    file["predictions/stiffness"][1, 3] += 1.0


def edit_seed(file: h5py.File) -> None:
    facts = json.loads(file.attrs["fleet"])
    facts["settings"]["seed"] += 1
    file.attrs["fleet"] = json.dumps(facts)


def edit_status(file: h5py.File) -> None:
    file.attrs["status"] = "failed"


@pytest.mark.parametrize("edit", [edit_draw, edit_next, edit_seed, edit_status])
def test_every_edit_is_found(file: Path, edit: Callable):
    with h5py.File(file, "r+") as opened:
        edit(opened)
    with pytest.raises(InputError, match=CHANGED) as caught:
        FleetPosterior.load(file)
    assert len(caught.value.findings) == 1


def test_a_lot_too_many_or_a_fact_too_few_is_refused(fleet, tmp_path):
    path, found = tmp_path / "posterior.nc", fleet.posterior
    one = replace(found, facts=replace(found.facts, lots=("high",)))
    path.write_bytes(one.to_netcdf())
    with pytest.raises(InputError, match="not a posterior that hdcal wrote"):
        FleetPosterior.load(path)
    facts = asdict(found.facts)
    del facts["largest_mm"]
    attributes = {"fleet": json.dumps(facts)}
    path.write_bytes(content(found.tree, FLEET, attributes))
    with pytest.raises(InputError, match="not a posterior that hdcal wrote"):
        FleetPosterior.load(path)


def test_one_kind_of_posterior_is_not_taken_for_the_other(file: Path, tmp_path):
    with pytest.raises(InputError, match="is of a fleet"):
        Posterior.load(file)
    single().save(tmp_path / "gear.nc")
    with pytest.raises(InputError, match="is of a calibration"):
        FleetPosterior.load(tmp_path / "gear.nc")
    assert kind_of(tmp_path / "gear.nc") is CALIBRATION
    with h5py.File(file, "r+") as opened:
        opened.attrs["hdcal_format"] = "hdcal.fleet-posterior/9"
    with pytest.raises(InputError, match="posterior/9, and this hdcal reads"):
        FleetPosterior.load(file)
    shutil.copy(Path(__file__), file)
    with pytest.raises(InputError, match="not a posterior that hdcal wrote"):
        FleetPosterior.load(file)
    with pytest.raises(InputError, match="no such file"):
        FleetPosterior.load(tmp_path / "nowhere.nc")


def test_a_fleet_that_failed_is_kept_and_not_used(fleet: Fleet, file: Path):
    check = replace(fleet.checks[0], outcome="failed", words="no chain agrees")
    replace(fleet, checks=(check,)).posterior.save(file)
    failed = FleetPosterior.load(file)
    assert failed.tree.attrs["status"] == "failed" and "FAILED" in repr(failed)
    with pytest.raises(NotUsable, match="no chain agrees"):
        failed.next_force(0.4)


def test_bounds_are_told_of_any_share_with_any_confidence(fleet: Fleet):
    usual = fleet.next_force(0.4)
    (alone,) = fleet.next_force(0.4, content=0.99).bounds
    assert alone == usual.bounds[1]
    (sure,) = fleet.next_force(0.4, content=0.99, confidence=0.9).bounds
    assert alone.at_least_N < sure.at_least_N < sure.at_most_N < alone.at_most_N
    for how, words in (
        ({"content": 0.5}, "content: 0.5 is no more than half"),
        ({"content": 1.0}, "content: 1 does not lie between"),
        ({"confidence": 0.99}, "400 draws cannot resolve a confidence"),
    ):
        with pytest.raises(InputError, match=words):
            fleet.next_force(0.4, **how)


def test_what_is_beyond_the_readings_and_of_other_sizes_is_said(fleet: Fleet):
    within, beyond = fleet.next_force(-0.5), fleet.next_force(0.51)
    assert (within.beyond_tested, beyond.beyond_tested) == (False, True)
    assert "larger than any that was read" in beyond._repr_html_()
    assert "larger than any that was read" not in within._repr_html_()
    sized = replace(fleet, size_ratio=np.array([1.0, 1.0, 1.1, 1.0])).next_force(0.4)
    assert "the next gear of the gear file's sizes needs" in repr(sized)


def test_a_margin_of_models_says_where_that_of_a_fleet_is(fleet: Fleet):
    for one in (fleet, fleet.posterior):
        with pytest.raises(InputError, match="Ask its own next_force"):
            hdcal.margin(one, 0.4)
