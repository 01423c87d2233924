"""The form of the noise is kept in the file of a posterior."""

from dataclasses import replace

import pytest
import xarray as xr
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import make_gear

from hdcal.errors import InputError
from hdcal.inference import noise_form
from hdcal.inference.posterior import PILOT_NOISE, Posterior
from hdcal.inference.serial_correlation import CORRELATION


def written(resolution: float = 0.0) -> Posterior:
    """Return a posterior of 30 readings whose pilot noise is about 0.6 N."""
    case = ramp_case(make_gear(resolution=resolution))
    return written_posterior(case, plain_draws(case, 400))


def test_the_form_of_the_noise_is_read_and_not_found_anew(tmp_path, monkeypatch):
    found = written()
    found = replace(found, settings={**found.settings, PILOT_NOISE: 0.6})
    found.save(tmp_path / "posterior.nc")

    def fit(records):
        raise AssertionError("a pilot fit for a file that has it")

    monkeypatch.setattr(noise_form, "pilot_fit", fit)
    back = Posterior.load(tmp_path / "posterior.nc")
    assert back.problem.correlated and not back.problem.rounded


def test_the_kept_form_decides_whether_a_file_is_whole(tmp_path):
    """Steps of 0.2 N are fine beside 0.6 N of noise, and coarse beside 0.1 N."""
    for noise, correlated in ((0.6, True), (0.1, False)):
        found = written(resolution=0.2)
        found = replace(found, settings={**found.settings, PILOT_NOISE: noise})
        tree = found.tree.copy()
        bare = tree["posterior"].to_dataset().drop_vars(CORRELATION)
        tree["posterior"] = xr.DataTree(bare)
        found = replace(found, tree=tree, diagnoses={})
        found.save(tmp_path / "posterior.nc")
        if correlated:
            with pytest.raises(InputError, match="damaged"):
                Posterior.load(tmp_path / "posterior.nc")
            continue
        problem = Posterior.load(tmp_path / "posterior.nc").problem
        assert problem.rounded and not problem.correlated
