"""A posterior file opens everywhere, and is read only as hdcal wrote it."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from posteriors import batch, single

from hdcal.errors import InputError, NotUsable
from hdcal.inference import problem as problem_module
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import DIGEST, FORMAT


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A posterior with labels, integers and booleans."""
    path = tmp_path / "posterior.nc"
    batch(3, 20).save(path)
    return path


def test_a_posterior_is_read_as_it_was_written(file: Path):
    written, read = batch(3, 20), Posterior.load(file)
    assert read.draws.keys() == written.draws.keys()
    for name, values in written.draws.items():
        np.testing.assert_array_equal(read.draws[name], values)
    for name in ("deformation", "force", "run", "temperature"):
        one, other = (getattr(p.case.records, name) for p in (read, written))
        np.testing.assert_array_equal(one, other)
    assert read.case.gear == written.case.gear
    assert read.case.run_labels == written.case.run_labels
    assert read.priors == written.priors
    assert read.diagnoses == written.diagnoses
    assert (read.checks, read.settings) == (written.checks, written.settings)
    assert read.to_netcdf() == file.read_bytes() == written.to_netcdf()


def test_xarray_opens_the_file_with_the_same_numbers(file: Path):
    with xr.open_datatree(file) as tree:
        np.testing.assert_array_equal(
            tree["posterior"]["K"].values.ravel(), batch(3, 20).draws["K"]
        )
        assert [*tree["posterior"]["run_label"].values] == ["0", "1", "2"]
        assert tree["observed_data"]["force"].attrs["units"] == "N"
        assert tree["sample_stats"]["diverging"].dtype == bool


def number(opened: h5py.File) -> None:
    opened["posterior/K"][0, 3] *= 1.0 + 1e-15


def label(opened: h5py.File) -> None:
    opened["posterior/run_label"][1] = "9"


def attribute(opened: h5py.File) -> None:
    opened.attrs["status"] = "failed"


def removed(opened: h5py.File) -> None:
    del opened["prior/alpha"]


def without_digest(opened: h5py.File) -> None:
    del opened.attrs[DIGEST]


@pytest.mark.parametrize("edit", [number, label, attribute, removed, without_digest])
def test_a_changed_file_is_refused(file: Path, edit):
    with h5py.File(file, "r+") as opened:
        edit(opened)
    with pytest.raises(InputError, match="was changed") as caught:
        Posterior.load(file)
    assert len(caught.value.findings) == 1


@pytest.mark.parametrize("version", ["hdcal.posterior/1", "hdcal.posterior/9"])
def test_another_version_is_refused(file: Path, version: str):
    with h5py.File(file, "r+") as opened:
        opened.attrs[FORMAT] = version
    with pytest.raises(InputError, match=version) as caught:
        Posterior.load(file)
    assert "calibrate again" in caught.value.findings[0].remedy


@pytest.mark.parametrize("kept", [0, 100, -100])
def test_a_damaged_file_is_refused(file: Path, kept: int):
    file.write_bytes(file.read_bytes()[:kept])
    with pytest.raises(InputError, match="damaged"):
        Posterior.load(file)


def test_a_foreign_file_is_refused(tmp_path: Path):
    file = tmp_path / "posterior.nc"
    xr.Dataset({"K": ("draw", np.ones(3))}).to_netcdf(file, engine="h5netcdf")
    with pytest.raises(InputError, match="not a posterior"):
        Posterior.load(file)


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="no such file"):
        Posterior.load(tmp_path)
    answer = '{"schema": "hdcal.verdict/2", "status": "failed", "reasons": ["R-hat"]}'
    (tmp_path / "verdict.json").write_text(answer)
    with pytest.raises(NotUsable, match="R-hat"):
        Posterior.load(tmp_path)


def without_a_site(draws: xr.Dataset) -> xr.Dataset:
    return draws.drop_vars("sigma")


def of_another_shape(draws: xr.Dataset) -> xr.Dataset:
    return draws.isel(run_label=[0, 1])


def not_finite(draws: xr.Dataset) -> xr.Dataset:
    return draws.assign(K=np.nan * draws["K"])


@pytest.mark.parametrize("change", [without_a_site, of_another_shape, not_finite])
def test_draws_of_another_model_are_refused(file: Path, change):
    tree = batch(3, 20).tree
    tree["posterior"] = xr.DataTree(change(tree["posterior"].to_dataset()))
    replace(batch(3, 20), tree=tree).save(file)
    with pytest.raises(InputError, match="not a posterior"):
        Posterior.load(file)


def test_an_effect_that_the_library_lacks_is_refused(file: Path):
    with pytest.raises(InputError, match="not in the library"):
        Posterior.load(_with_effect(file), effects={})


def _with_effect(file: Path) -> Path:
    from posteriors import beside

    beside(single(size=20), "contact_onset").save(file)
    return file


def test_the_structure_is_read_and_not_decided_again(file: Path, monkeypatch):
    single(size=20).save(file)
    monkeypatch.setattr(problem_module, "decide_structure", None)
    problem = Posterior.load(file).problem
    assert problem.correlated and not problem.rounded
