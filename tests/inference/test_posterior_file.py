"""A posterior file opens everywhere, and is read only as hdcal wrote it."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from posteriors import batch, beside, single, with_discrepancy

from hdcal.errors import InputError, NotUsable
from hdcal.inference.force_model import problem as problem_module
from hdcal.inference.model_average import LeftOut, ModelAverage, load_models
from hdcal.inference.posterior import HYPOTHESIS, Posterior
from hdcal.inference.posterior_file import DIGEST, FORMAT

SHARES = {"none": 0.5, "contact_onset": 0.3, "unknown": 0.2}
LABELLED = batch(3, 20)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A posterior with labels, integers and booleans."""
    path = tmp_path / "posterior.nc"
    LABELLED.save(path)
    return path


@pytest.fixture(scope="module")
def average() -> ModelAverage:
    models = (
        single(size=40),
        beside(single(size=40), "contact_onset"),
        with_discrepancy(60),
    )
    weighed = zip(SHARES.values(), models, strict=True)
    left_out = LeftOut(0.04, "unknown")
    return ModelAverage(dict(zip(SHARES, weighed, strict=True)), left_out)


def test_a_posterior_is_read_as_it_was_written(file: Path):
    read = Posterior.load(file)
    assert read.draws.keys() == LABELLED.draws.keys()
    for name, values in LABELLED.draws.items():
        np.testing.assert_array_equal(read.draws[name], values)
    for name in ("deformation", "force", "run", "temperature"):
        one, other = (getattr(p.case.records, name) for p in (read, LABELLED))
        np.testing.assert_array_equal(one, other)
    assert read.case.gear == LABELLED.case.gear
    assert read.case.run_labels == LABELLED.case.run_labels
    assert read.case.records.known == LABELLED.case.records.known
    assert (read.priors, read.diagnoses) == (LABELLED.priors, LABELLED.diagnoses)
    assert (read.checks, read.settings) == (LABELLED.checks, LABELLED.settings)
    assert read.to_netcdf() == file.read_bytes()


def test_xarray_opens_the_file_with_the_same_numbers(file: Path):
    with xr.open_datatree(file) as tree:
        drawn = tree["posterior"]["K"].values.ravel()
        np.testing.assert_array_equal(drawn, LABELLED.draws["K"])
        assert [*tree["posterior"]["run_label"].values] == ["0", "1", "2"]
        assert tree["observed_data"]["force"].attrs["units"] == "N"


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


def older(opened: h5py.File) -> None:
    opened.attrs[FORMAT] = "hdcal.posterior/1"


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        *((e, "changed") for e in (number, label, attribute, removed, without_digest)),
        (older, "hdcal.posterior/1"),
    ],
)
def test_a_changed_file_is_refused(file: Path, edit, words: str):
    with h5py.File(file, "r+") as opened:
        edit(opened)
    with pytest.raises(InputError, match=words) as caught:
        Posterior.load(file)
    assert len(caught.value.findings) == 1


@pytest.mark.parametrize("kept", [0, 100, -100])
def test_a_damaged_file_is_refused(file: Path, kept: int):
    file.write_bytes(file.read_bytes()[:kept])
    with pytest.raises(InputError, match="damaged"):
        Posterior.load(file)


def test_a_foreign_file_and_a_missing_one_are_refused(tmp_path: Path):
    file = tmp_path / "posterior.nc"
    with pytest.raises(InputError, match="no such file"):
        Posterior.load(tmp_path)
    xr.Dataset({"K": ("draw", np.ones(3))}).to_netcdf(file, engine="h5netcdf")
    with pytest.raises(InputError, match="not a posterior"):
        Posterior.load(file)
    file.unlink()
    answer = {"schema": "hdcal.verdict/3", "status": "failed", "reasons": ["R-hat 2"]}
    (tmp_path / "verdict.json").write_text(json.dumps(answer))
    with pytest.raises(NotUsable, match="R-hat 2"):
        Posterior.load(tmp_path)


def test_an_effect_that_the_library_lacks_is_refused(file: Path):
    beside(single(size=20), "contact_onset").save(file)
    with pytest.raises(InputError, match="not in the library"):
        Posterior.load(file, effects={})


def test_the_structure_is_read_and_not_decided_again(file: Path, monkeypatch):
    single(size=20).save(file)
    monkeypatch.setattr(problem_module, "decide_structure", None)
    problem = Posterior.load(file).problem
    assert problem.correlated and not problem.rounded


def test_an_average_is_a_group_for_each_model(average: ModelAverage, tmp_path: Path):
    average.save(tmp_path / "posterior.nc")
    with xr.open_datatree(tmp_path / "posterior.nc") as tree:
        assert {n: node.attrs["probability"] for n, node in tree.items()} == SHARES
        assert tree["none/posterior/K"].shape == (2, 20)
        assert "gap_weights" not in tree["contact_onset/posterior"]
    found = load_models(tmp_path)
    assert isinstance(found, ModelAverage)
    assert found.left_out == average.left_out
    assert {name: share for name, (share, _) in found.posteriors.items()} == SHARES
    for name, (_, model) in average.posteriors.items():
        read = found.posteriors[name][1]
        assert read.settings[HYPOTHESIS] == name and read.effects == model.effects
        for site, values in model.draws.items():
            np.testing.assert_array_equal(read.draws[site], values)


def test_an_average_is_no_single_posterior(average: ModelAverage, file: Path):
    with pytest.raises(InputError):
        ModelAverage.load(file)
    average.save(file)
    with pytest.raises(InputError, match="several models"):
        Posterior.load(file)
