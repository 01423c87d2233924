"""Runs and gears are members of the model; effects of scatter name them, no more."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
import pytest
from numpyro.infer import Predictive
from rigs import make_case, make_gear, make_records
from short import SHORT

from hdcal import calibrate
from hdcal.calibration.known_effects import check_effect_priors
from hdcal.data.priors import Prior, effect_priors, rig_priors
from hdcal.errors import InputError
from hdcal.inference.force_model import model
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.values import MEMBER_SD
from hdcal.inference.posterior import Posterior
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.registry import EFFECTS

SCATTER = [name for name, each in EFFECTS.items() if issubclass(each, Scatter)]
scatter = pytest.mark.parametrize("name", SCATTER)
# Of each gear in comparison to the first, and of each run [N].
STIFFER, OFFSETS = np.array([1.0, 1.08, 0.93]), np.array([0.0, 3.0, -2.0])


def case_with(labels: int):
    """Return a case of so many runs, each on a gear of its own."""
    label = np.repeat(np.arange(labels), 40)
    deformation = np.tile(np.linspace(0.02, 0.54, 40), labels)
    noise = np.random.default_rng(labels).normal(0.0, 0.3, 40 * labels)
    force = 205.0 * STIFFER[label] * deformation + OFFSETS[label] + noise
    known = {"run", "specimen"} | ({"runs", "specimens"} if labels > 2 else set())
    records = make_records(deformation, force, run=label, specimen=label, known=known)
    return make_case(records)


@pytest.mark.parametrize("known_sd", [0.01, 100.0])
def test_members_have_their_distribution_however_they_are_sampled(known_sd: float):
    def members():
        model._sample_deviations("run_offset", 2.0, known_sd, 5)

    drawn = Predictive(members, num_samples=20_000)(jax.random.key(0))["run_offset"]
    # Deviations from the mean of five.
    assert np.std(drawn) == pytest.approx(2.0 * np.sqrt(0.8), rel=0.02)
    assert np.sum(drawn, axis=1) == pytest.approx(0.0, abs=1e-9)


@scatter
def test_an_effect_of_scatter_changes_nothing(name):
    assert {EFFECTS[each].members for each in SCATTER} == {*MEMBER_SD}
    bare = build_problem(case_with(3), effect_priors())
    found = build_problem(case_with(3), effect_priors(), (EFFECTS[name],))
    assert eqx.tree_equal(found, bare)
    assert bare.runs == bare.specimens == 3
    with pytest.raises(InputError, match=f"'{name}' needs "):
        build_problem(case_with(2), effect_priors(), (EFFECTS[name],))


@scatter
def test_the_spread_has_its_prior_under_the_name_of_the_members(name):
    shipped, site = effect_priors()[f"{name}.sd"], MEMBER_SD[EFFECTS[name].members]
    same = rig_priors()[site]
    assert (shipped.family, shipped.numbers) == (same.family, same.numbers)
    prior = Prior("half_normal", (1.0,), shipped.unit)
    gear = replace(make_gear(), effect_priors={f"{name}.sd": prior})
    with pytest.raises(InputError, match=site):
        check_effect_priors(replace(case_with(3), gear=gear))


@pytest.mark.thorough
def test_gears_have_a_stiffness_and_runs_an_offset_each(tmp_path):
    found = calibrate(case_with(3), effects=["run_offset"], **SHORT)
    stiffer = found.draws["specimen_deviation"].mean(axis=0)
    assert stiffer == pytest.approx(STIFFER / STIFFER.mean() - 1.0, abs=0.01)
    offsets = found.draws["run_offset"]
    assert offsets.mean(axis=0) == pytest.approx(OFFSETS - OFFSETS.mean(), abs=0.3)
    assert offsets.sum(axis=1) == pytest.approx(0.0, abs=1e-9)
    found.save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path)
    assert back.effects == (EFFECTS["run_offset"],)
    assert eqx.tree_equal(back.problem, found.problem)


@pytest.mark.thorough
@pytest.mark.parametrize("apart", [0.0, 1.0])
def test_members_that_are_sampled_mix(apart: float):
    """Rounded, so that they are sampled; alike or apart, without a divergence."""
    run = np.repeat(np.arange(3), 16)
    deformation = np.tile([*np.linspace(0.0, 0.4, 9), *np.linspace(0.35, 0.05, 7)], 3)
    noise = np.random.default_rng(1).normal(0.0, 0.3, 48)
    force = 150.0 * deformation + 1.0 + apart * OFFSETS[run] + noise
    records = make_records(
        deformation, 0.5 * np.round(force / 0.5), run=run, known={"run", "runs"}
    )
    found = calibrate(make_case(records, make_gear(resolution=0.5)))
    assert "run" not in found.problem.integrated
    assert found.usable
    assert found.diagnoses["run_offset_sd"].ess_bulk > 2000.0
