"""A posterior file that was changed after hdcal wrote it is refused, with words."""

import json
import shutil
from pathlib import Path

import h5py
import pytest
from posteriors import batch

from hdcal.errors import InputError
from hdcal.inference import posterior_file
from hdcal.inference.posterior import Posterior

CHANGED = "was changed after hdcal wrote it"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A posterior with every kind of array: labels, integers, booleans."""
    path = tmp_path_factory.mktemp("sealed") / "posterior.nc"
    batch(3, 20).save(path)
    return path


@pytest.fixture
def copy(file: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(file, tmp_path / "posterior.nc"))


def test_an_unchanged_file_is_taken_and_keeps_its_digest(file: Path, tmp_path: Path):
    first = Posterior.load(file)
    assert first.usable
    # Written again by whoever read it, it is the same once more.
    again = tmp_path / "again.nc"
    first.save(again)
    assert again.read_bytes() == first.to_netcdf()
    found = posterior_file.digest(Posterior.load(again).arrays)
    assert found == posterior_file.digest(first.arrays)


def edit_number(file: h5py.File) -> None:
    file["posterior/K"][0, 3] *= 1.0 + 1e-15


def edit_data(file: h5py.File) -> None:
    file["observed_data/force"][2] += 1.0


def edit_sampler(file: h5py.File) -> None:
    file["sample_stats/diverging"][0, 0] = 1


def edit_label(file: h5py.File) -> None:
    file["posterior/run_label"][1] = "9"


def edit_status(file: h5py.File) -> None:
    file.attrs["status"] = "failed"


def edit_checks(file: h5py.File) -> None:
    model = json.loads(file.attrs["model"])
    model["checks"][0]["words"] = "other"
    file.attrs["model"] = json.dumps(model)


def edit_gear(file: h5py.File) -> None:
    case = json.loads(file.attrs["case"])
    case["gear"]["geometry"]["wall_thickness"] *= 1.01
    file.attrs["case"] = json.dumps(case)


def remove_variable(file: h5py.File) -> None:
    del file["prior/alpha"]


def swap_variables(file: h5py.File) -> None:
    file.move("posterior/K", "posterior/other")
    file.move("posterior/alpha", "posterior/K")
    file.move("posterior/other", "posterior/alpha")


EDITS = [
    edit_number,
    edit_data,
    edit_sampler,
    edit_label,
    edit_status,
    edit_checks,
    edit_gear,
    remove_variable,
    swap_variables,
]


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.__name__)
def test_every_edit_is_found(copy: Path, edit):
    with h5py.File(copy, "r+") as opened:
        edit(opened)
    with pytest.raises(InputError, match=CHANGED) as caught:
        Posterior.load(copy)
    assert len(caught.value.findings) == 1


def test_an_edit_through_xarray_is_found(copy: Path):
    tree = posterior_file.open_tree(copy).datatree
    tree["posterior"]["K"][0, 0] += 0.1
    tree.to_netcdf(copy, mode="w", engine="h5netcdf")
    with pytest.raises(InputError, match=CHANGED):
        Posterior.load(copy)


def test_a_file_without_digest_is_an_older_one(copy: Path):
    with h5py.File(copy, "r+") as opened:
        del opened.attrs[posterior_file.DIGEST]
    with pytest.raises(InputError, match="an older version of hdcal"):
        Posterior.load(copy)


def test_another_format_is_named(copy: Path):
    with h5py.File(copy, "r+") as opened:
        opened.attrs["hdcal_format"] = "hdcal.posterior/9"
    with pytest.raises(InputError, match="posterior/9, and this hdcal reads"):
        Posterior.load(copy)
