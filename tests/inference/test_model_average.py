"""The models of a diagnosis are groups of one file, each with its probability."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from posteriors import beside, single, with_leftover

from hdcal.errors import InputError
from hdcal.inference.model_average import LeftOut, ModelAverage, load_models
from hdcal.inference.posterior import HYPOTHESIS, Posterior

SHARES = {"none": 0.5, "contact_onset": 0.3, "unknown": 0.2}


@pytest.fixture(scope="module")
def average() -> ModelAverage:
    models = (
        single(size=40),
        beside(single(size=40), "contact_onset"),
        with_leftover(60),
    )
    weighed = zip(SHARES.values(), models, strict=True)
    return ModelAverage(
        dict(zip(SHARES, weighed, strict=True)), LeftOut(0.04, "unknown")
    )


def test_an_average_is_read_as_it_was_written(average: ModelAverage, tmp_path: Path):
    average.save(tmp_path / "posterior.nc")
    found = load_models(tmp_path)
    assert isinstance(found, ModelAverage)
    assert found.left_out == average.left_out
    assert {name: share for name, (share, _) in found.posteriors.items()} == SHARES
    for name, (_, model) in average.posteriors.items():
        read = found.posteriors[name][1]
        assert read.settings[HYPOTHESIS] == name
        assert read.effects == model.effects
        assert read.draws.keys() == model.draws.keys()
        for site, values in model.draws.items():
            np.testing.assert_array_equal(read.draws[site], values)


def test_each_model_is_a_group_with_its_weight(average: ModelAverage, tmp_path: Path):
    average.save(tmp_path / "posterior.nc")
    with xr.open_datatree(tmp_path / "posterior.nc") as tree:
        assert {n: node.attrs["probability"] for n, node in tree.items()} == SHARES
        assert tree["none/posterior/K"].shape == (2, 20)
        assert "gap_weights" not in tree["contact_onset/posterior"]


def test_an_average_is_no_single_posterior(average: ModelAverage, tmp_path: Path):
    average.save(tmp_path / "posterior.nc")
    with pytest.raises(InputError, match="several models"):
        Posterior.load(tmp_path)
    single(size=20).save(tmp_path / "posterior.nc")
    with pytest.raises(InputError):
        ModelAverage.load(tmp_path)
