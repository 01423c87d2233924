"""Draws of several hypotheses are one file: whoever reads it has the average."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest
import xarray as xr
from posteriors import (
    beside,
    plain_draws,
    ramp_case,
    single,
    with_leftover,
    written_posterior,
)
from trees import with_tree

from hdcal.errors import InputError
from hdcal.inference.hypotheses import HYPOTHESIS, ORIGIN
from hdcal.inference.mixed_posterior import mixed_posterior, models_of
from hdcal.inference.posterior import Posterior
from hdcal.prediction.engine.forces import force_of, grid_records

SHARES = {"none": 0.5, "progressive_stiffening": 0.3, "contact_onset": 0.15}
SHARES |= {"unknown": 0.05}
AT = grid_records(np.array([0.1, 0.3, 0.5]), np.full(3, 20.0), np.ones(3), 0.0)


def stiffening() -> Posterior:
    case, name = ramp_case(), "progressive_stiffening"
    slope = np.random.default_rng(0).normal(0.2, 0.02, 2000)
    draws = plain_draws(case, 2000, seed=1) | {f"{name}.slope": slope}
    return written_posterior(case, draws, effects=[name])


@pytest.fixture(scope="module")
def models() -> dict[str, tuple[float, Posterior]]:
    made = single(), stiffening(), beside(single(), "contact_onset"), with_leftover()
    return {n: (p, m) for (n, p), m in zip(SHARES.items(), made, strict=True)}


@pytest.fixture(scope="module")
def mixed(models) -> Posterior:
    return mixed_posterior(models)


def test_a_parameter_is_known_as_well_as_by_the_worst_model(models):
    share, first = models["none"]
    poor = replace(first.diagnoses["K"], rhat=1.001, ess_tail=120.0)
    slow = replace(first.diagnoses["K"], rhat=1.004, ess_tail=900.0)
    each = [
        (share, replace(first, diagnoses={**first.diagnoses, "K": found}))
        for found in (poor, slow)
    ]
    worst = mixed_posterior(dict(zip(("none", "unknown"), each, strict=True)))
    assert worst.diagnoses["K"].rhat == 1.004
    assert worst.diagnoses["K"].ess_tail == 120.0


def forces(posterior: Posterior) -> np.ndarray:
    """Return the mean reading of every draw, by whoever knows of no hypotheses."""
    problem = posterior.problem
    return np.asarray(jax.vmap(lambda v: force_of(problem, v, AT)[0])(posterior.draws))


def test_a_file_of_several_models_is_read_back(mixed: Posterior, tmp_path: Path):
    file = tmp_path / "posterior.nc"
    mixed.save(file)
    found = models_of(Posterior.load(file))
    assert [share for share, _ in found] == list(SHARES.values())
    for name, (_, alone) in zip(SHARES, found, strict=True):
        effects = {effect.name for effect in alone.effects}
        assert effects == {name} - {"none", "unknown"}
        assert alone.settings["with_gap"] == (name == "unknown")
        assert alone.settings[ORIGIN]["hypothesis"] == name
        sites = alone.sites(alone.case, alone.effects, name == "unknown")
        assert {*alone.draws} == {*sites}


def test_offsets_of_runs_are_a_hypothesis_too(tmp_path: Path):
    """How much runs differ is in every model: no amplitude of an effect is sought."""
    models = {"none": (0.8, single(size=200))}
    models["run_offset"] = (0.2, beside(single(size=200), "run_offset"))
    mixed_posterior(models).save(tmp_path / "posterior.nc")
    found = models_of(Posterior.load(tmp_path / "posterior.nc"))
    assert [share for share, _ in found] == [0.8, 0.2]


def test_any_reader_of_netcdf_sees_the_hypotheses(mixed: Posterior, tmp_path: Path):
    mixed.save(tmp_path / "posterior.nc")
    with xr.open_datatree(tmp_path / "posterior.nc", engine="h5netcdf") as tree:
        draws = tree["posterior"].to_dataset().load()
    count = draws["K"].groupby(HYPOTHESIS).count(...)
    for name, share in SHARES.items():
        assert int(count.sel(hypothesis=name)) == pytest.approx(share * 2000, abs=4)


@pytest.mark.thorough
def test_the_draws_together_are_those_of_each_model(models, mixed: Posterior):
    """As one model with all of the effects: absent ones change nothing."""
    whole, parts = forces(mixed), models_of(mixed)
    labels = np.tile(mixed.tree["posterior"][HYPOTHESIS].to_numpy(), 2)
    for name, (_, alone) in zip(SHARES, parts, strict=True):
        np.testing.assert_allclose(whole[labels == name], forces(alone), rtol=1e-12)
    tails = [0.025, 0.5, 0.975]
    parts = [np.tile(forces(m), (round(100 * p), 1)) for p, m in models.values()]
    every = np.concatenate(parts)
    found, expected = (np.quantile(f, tails, axis=0) for f in (whole, every))
    np.testing.assert_allclose(found, expected, rtol=2e-3)
    # The likeliest alone is something else.
    alone = np.quantile(forces(models["none"][1]), tails, axis=0)
    assert np.max(np.abs(alone - expected)) > 1.0


def test_one_model_stays_what_it_is(models):
    _, posterior = models["none"]
    assert mixed_posterior({"none": (1.0, posterior)}) is posterior
    assert models_of(posterior) == [(1.0, posterior)]


def of_effect(tree: xr.DataTree) -> None:
    tree["posterior"]["progressive_stiffening.slope"][:, 0] = 0.1


def of_gap(tree: xr.DataTree) -> None:
    tree["posterior"]["gap_weights"][:, 0, 2] = 1.0


def relabelled(tree: xr.DataTree) -> None:
    labels = tree["posterior"][HYPOTHESIS].to_numpy().copy()
    labels[:] = "none"
    tree["posterior"] = (
        tree["posterior"].to_dataset().assign_coords({HYPOTHESIS: ("draw", labels)})
    )


def numbered(tree: xr.DataTree) -> None:
    count = tree["posterior"].sizes["draw"]
    tree["posterior"] = (
        tree["posterior"]
        .to_dataset()
        .assign_coords({HYPOTHESIS: ("draw", np.arange(count))})
    )


def unlabelled(tree: xr.DataTree) -> None:
    tree["posterior"] = tree["posterior"].to_dataset().drop_vars(HYPOTHESIS)


CHANGES = [of_effect, of_gap, relabelled, numbered, unlabelled]


@pytest.mark.parametrize("change", CHANGES)
def test_draws_that_are_no_mixture_are_refused(mixed: Posterior, tmp_path, change):
    tree = mixed.tree.copy(deep=True)
    change(tree)
    file = tmp_path / "posterior.nc"
    with_tree(mixed, tree).save(file)
    with pytest.raises(InputError, match="is not a posterior that hdcal wrote"):
        Posterior.load(file)


ORIGINS = {
    "other hypotheses": {"hypothesis": None, "probabilities": {"none": 1.0}},
    "more than all": {"hypothesis": None, "probabilities": {**SHARES, "none": 0.9}},
    "of one": {"hypothesis": "none", "probabilities": SHARES},
    "a foreign one": {"hypothesis": "a", "probabilities": SHARES},
    "no number": {"hypothesis": None, "probabilities": dict.fromkeys(SHARES, "much")},
    "text": "none",
}


@pytest.mark.parametrize("name", ORIGINS)
def test_what_a_file_says_of_its_hypotheses_has_to_hold(mixed, tmp_path, name: str):
    settings = {**mixed.settings, ORIGIN: ORIGINS[name]}
    file = tmp_path / "posterior.nc"
    replace(mixed, settings=settings).save(file)
    with pytest.raises(InputError, match="is not a posterior that hdcal wrote"):
        Posterior.load(file)
