"""Runs and gears are members of the model; effects of scatter name them, no more."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
import pytest
from numpyro.infer import Predictive
from rigs import make_case, make_gear, make_records
from short import SHORT

from hdcal.calibration.calibrate import calibrate, check_effect_priors
from hdcal.calibration.calibration import summarise
from hdcal.data.priors import Prior, effect_priors, rig_priors
from hdcal.errors import InputError
from hdcal.inference import model
from hdcal.inference.members import MEMBER_SD, MEMBERS
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import build_problem
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


def test_both_kinds_of_member_have_their_effect():
    assert SCATTER == ["specimen_variation", "run_offset"]
    assert {EFFECTS[name].members for name in SCATTER} == set(MEMBER_SD)
    assert set(MEMBER_SD) < set(MEMBERS)


@pytest.mark.parametrize("seen_sd", [0.01, 1.0, 100.0])
def test_members_have_their_law_however_they_are_sampled(seen_sd: float):
    def members():
        model._sample_deviations("run_offset", 2.0, seen_sd, 5)

    drawn = Predictive(members, num_samples=20_000)(jax.random.key(0))["run_offset"]
    # Deviations from the mean of five.
    assert np.std(drawn) == pytest.approx(2.0 * np.sqrt(0.8), rel=0.02)
    assert np.sum(drawn, axis=1) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("apart", [0.0, 1.0])
def test_members_alike_and_apart_sample_without_a_divergence(apart: float):
    """Rounded, so that they are sampled: the first steps tried do, of three mostly."""
    run = np.repeat(np.arange(3), 16)
    deformation = np.tile([*np.linspace(0.0, 0.4, 9), *np.linspace(0.35, 0.05, 7)], 3)
    noise = np.random.default_rng(1).normal(0.0, 0.3, 48)
    force = 150.0 * deformation + 1.0 + apart * OFFSETS[run] + noise
    records = make_records(
        deformation, 0.5 * np.round(force / 0.5), run=run, known={"run", "runs"}
    )
    case = make_case(records, make_gear(resolution=0.5))
    tried = []
    for seed in range(3):
        found = calibrate(case, seed=seed)
        assert "run" not in found.problem.integrated
        assert found.usable
        assert found.diagnoses["run_offset_sd"].ess_bulk > 2000.0
        tried.append(found.settings["target_acceptance"])
    assert tried.count(0.8) >= 2


@scatter
def test_the_problem_is_the_one_without(name):
    case = case_with(3)
    slack = EFFECTS["seating_slack"]
    for others in ((), (slack,)):
        bare = build_problem(case, effect_priors(), others)
        found = build_problem(case, effect_priors(), (EFFECTS[name], *others))
        assert eqx.tree_equal(found, bare)
    assert bare.runs == bare.specimens == 3


@scatter
def test_too_few_members_are_refused(name):
    with pytest.raises(InputError, match=f"'{name}' needs "):
        build_problem(case_with(2), effect_priors(), (EFFECTS[name],))


@scatter
def test_the_spread_has_the_same_prior_under_both_names(name):
    found = effect_priors()[f"{name}.sd"]
    own = rig_priors()[MEMBER_SD[EFFECTS[name].members]]
    assert (found.family, found.numbers, found.unit) == (
        own.family,
        own.numbers,
        own.unit,
    )


@scatter
def test_a_prior_under_the_effects_name_is_refused(name):
    prior = Prior("half_normal", (1.0,), effect_priors()[f"{name}.sd"].unit)
    gear = replace(make_gear(), effect_priors={f"{name}.sd": prior})
    with pytest.raises(InputError, match=MEMBER_SD[EFFECTS[name].members]):
        check_effect_priors(replace(case_with(3), gear=gear))


@pytest.fixture(scope="module")
def bare():
    """Return a calibration without effects."""
    return calibrate(case_with(3), **SHORT)


@pytest.mark.thorough
def test_gears_have_a_stiffness_and_runs_an_offset_each(bare):
    stiffer = bare.draws["specimen_deviation"].mean(axis=0)
    assert stiffer == pytest.approx(STIFFER / STIFFER.mean() - 1.0, abs=0.01)
    offsets = bare.draws["run_offset"]
    assert offsets.mean(axis=0) == pytest.approx(OFFSETS - OFFSETS.mean(), abs=0.3)
    assert offsets.sum(axis=1) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.thorough
def test_a_calibration_keeps_the_name_and_no_more(bare, tmp_path):
    found = calibrate(case_with(3), effects=["run_offset"], **SHORT)
    assert found.effects == (EFFECTS["run_offset"],)
    assert found.priors.keys() == bare.priors.keys()
    for name, values in bare.draws.items():
        assert np.array_equal(found.draws[name], values), name
    found.save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path)
    assert eqx.tree_equal(back.problem, bare.problem)
    summary = summarise(back)
    assert summary["effects"] == ["run_offset"]
    assert summary["parameters"].keys() == summarise(bare)["parameters"].keys()
