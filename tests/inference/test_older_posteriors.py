"""A file of before correlation was inferred has none; the form of the noise is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import cycles, make_case, make_gear
from trees import arrays_of

import hdcal
from hdcal.errors import InputError
from hdcal.inference import noise_form
from hdcal.inference.held import LOOP, PILOT_NOISE
from hdcal.inference.posterior import Posterior
from hdcal.inference.serial_correlation import CORRELATION


def written(resolution: float = 0.0) -> Posterior:
    """Return a posterior of 30 readings whose pilot noise is about 0.6 N."""
    case = ramp_case(make_gear(resolution=resolution))
    return written_posterior(case, plain_draws(case, 400))


def looped() -> Posterior:
    """Return a quick calibration with a leftover of a rig that unloads too."""
    records = cycles(96)
    noise = np.random.default_rng(0).normal(0.0, 0.3, 96)
    case = make_case(replace(records, force=records.force + noise))
    size = {"warmup": 100, "draws": 20, "chains": 2}
    return hdcal.calibrate(case, with_gap=True, **size)


def without_correlation(posterior: Posterior) -> Posterior:
    """Return a posterior as hdcal 0.1.0 wrote it."""
    case, tree = posterior.case, posterior.tree.copy()
    scales = {n: p for n, p in case.gear.scale_priors.items() if n != CORRELATION}
    for group in ("posterior", "prior"):
        tree[group] = xr.DataTree(tree[group].to_dataset().drop_vars(CORRELATION))
    return replace(
        posterior,
        case=replace(case, gear=replace(case.gear, scale_priors=scales)),
        priors={n: p for n, p in posterior.priors.items() if n != CORRELATION},
        diagnoses={n: d for n, d in posterior.diagnoses.items() if n != CORRELATION},
        arrays=arrays_of(tree),
    )


@pytest.mark.thorough
def test_an_older_file_answers_as_without_correlation(tmp_path: Path):
    now = written()
    without_correlation(now).save(tmp_path / "posterior.nc")
    old = Posterior.load(tmp_path / "posterior.nc")
    assert now.problem.correlated and not old.problem.correlated
    # The draws of `now` have a correlation of nothing.
    bands = [hdcal.predict(one, [0.1, 0.4], [20.0]) for one in (now, old)]
    np.testing.assert_allclose(bands[1].physics_hi_N, bands[0].physics_hi_N)
    margins = [hdcal.margin(one, 0.4, sensitivities=False) for one in (now, old)]
    assert margins[1].worst.upper_bound_N == pytest.approx(
        margins[0].worst.upper_bound_N
    )
    # It is written as whole as it was read.
    old.save(tmp_path / "again.nc")
    assert not Posterior.load(tmp_path / "again.nc").problem.correlated


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
        found = replace(found, arrays=arrays_of(tree), diagnoses={})
        found.save(tmp_path / "posterior.nc")
        if correlated:
            with pytest.raises(InputError, match="damaged"):
                Posterior.load(tmp_path / "posterior.nc")
            continue
        problem = Posterior.load(tmp_path / "posterior.nc").problem
        assert problem.rounded and not problem.correlated


@pytest.mark.thorough
def test_a_leftover_of_before_it_knew_loading_from_unloading_is_read(tmp_path):
    """It had twenty weights whatever was tested; a new file of such data has thirty."""
    now = looped()
    tree = now.tree.copy()
    for group in ("posterior", "prior"):
        held = tree[group].to_dataset()
        if "gap_weights" in held:
            last = held["gap_weights"].dims[-1]
            tree[group] = xr.DataTree(held.isel({last: slice(20)}))
    settings = {name: kept for name, kept in now.settings.items() if name != LOOP}
    old = replace(now, arrays=arrays_of(tree), settings=settings)
    old.save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path / "posterior.nc")
    assert back.draws["gap_weights"].shape[1] == 20
    assert not back.problem.discrepancy.directed
    up, down = (
        hdcal.predict(back, [0.3], [20.0], way, allow_failed=True).with_gap_median_N
        for way in ("up", "down")
    )
    assert up == pytest.approx(down)
    # A new file that holds too few is damaged as ever.
    replace(old, settings=now.settings).save(tmp_path / "posterior.nc")
    with pytest.raises(InputError, match="damaged"):
        Posterior.load(tmp_path / "posterior.nc")
