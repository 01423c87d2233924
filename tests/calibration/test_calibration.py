"""Calibration as a library call: repeatable, kept whole on disk, clear when refused."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import (
    cycles,
    draw_truth,
    make_case,
    make_gear,
    make_records,
    program,
    ramp,
    simulate,
)
from short import SHORT
from structures import form_of

from hdcal.calibration.calibrate import calibrate, choose_effects
from hdcal.calibration.calibration import summarise
from hdcal.data.priors import Prior, effect_priors
from hdcal.errors import InputError
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.marginal import draw_members
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import build_problem
from hdcal.physics.effect import parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.registry import EFFECTS


def with_force(records, sd=0.5):
    noise = np.random.default_rng(0).normal(0.0, sd, len(records.force))
    force = 205.0 * np.asarray(records.deformation) - 1.0 + noise
    return replace(records, force=force)


@pytest.fixture(scope="module")
def posterior():
    return calibrate(make_case(with_force(ramp(40))), seed=4, **SHORT)


def test_what_was_sampled_is_what_would_be_built_anew(posterior):
    sampled, built = vars(posterior)["problem"], replace(posterior).problem
    assert jax.tree.structure(sampled) == jax.tree.structure(built)
    for one, other in zip(*map(jax.tree.leaves, (sampled, built)), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_draws(posterior):
    case = posterior.case
    again, other = (calibrate(case, seed=seed, **SHORT) for seed in (4, 5))
    for name, values in posterior.draws.items():
        assert np.array_equal(values, again.draws[name]), name
    assert not np.array_equal(posterior.draws["K"], other.draws["K"])


def test_a_posterior_survives_the_disk(posterior, tmp_path):
    posterior.save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path)
    assert summarise(back) == summarise(posterior)
    for name, values in posterior.draws.items():
        assert np.array_equal(values, back.draws[name])
    assert back.case.records.known == posterior.case.records.known
    groups = {
        "posterior",
        "prior",
        "sample_stats",
        "observed_data",
        "constant_data",
        "log_likelihood",
    }
    assert set(back.tree.children) == groups


@pytest.mark.parametrize("damage", ["missing", "text", "cut", "foreign"])
def test_a_damaged_posterior_is_refused(posterior, tmp_path, damage):
    path = tmp_path / "posterior.nc"
    posterior.save(path)
    if damage == "missing":
        path.unlink()
    elif damage == "text":
        path.write_text("not a posterior")
    elif damage == "cut":
        path.write_bytes(path.read_bytes()[:3000])
    else:
        posterior.tree.to_netcdf(path, mode="w", engine="h5netcdf")
    with pytest.raises(InputError):
        Posterior.load(path)


def test_an_unknown_effect_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="Did you mean 'coulomb_friction'"):
        choose_effects(["coulomb_frction"])
    assert choose_effects(["outliers", "outliers"]) == (EFFECTS["outliers"],)


def test_an_effect_without_its_covariates_is_refused():
    case = make_case(with_force(ramp()))
    with pytest.raises(InputError) as caught:
        calibrate(case, effects=["coulomb_friction", "thermal_zero_drift"])
    assert len(caught.value.findings) == 2
    assert "needs unloading" in str(caught.value)


@pytest.mark.parametrize("setting", [{"chains": 1}, {"warmup": 0}, {"draws": 2}])
def test_too_small_settings_are_refused(setting):
    with pytest.raises(InputError):
        calibrate(make_case(with_force(ramp())), **setting)


def test_what_no_data_can_tell_is_refused():
    with pytest.raises(InputError, match="needs bare_rig"):
        calibrate(make_case(cycles(240)), effects=["rig_compliance"])


# The spread of members is a parameter of the model itself, see test_scatter; the
# compliance of the rig is no part of any data: it is the stiffness itself.
WITH_SITES = [
    name
    for name, each in EFFECTS.items()
    if not issubclass(each, Scatter) and name != "rig_compliance"
]


# One of every stage, and one that remembers.
SLICE = ("thermal_expansion", "coulomb_friction", "charge_leakage", "outliers")


@pytest.mark.thorough
def test_a_slice_of_effects_is_recovered_side_by_side():
    assert_recovered(SLICE)


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_SITES)
def test_every_effect_is_recovered(name):
    assert_recovered((name,))


def assert_recovered(names):
    """Effects of the library at their typical sizes: truth in the 99 % interval."""
    # Into tension too: with one sign only, play and offset are one parameter.
    effects, records = choose_effects(names), cycles(240, start=-0.1)
    enough = all(effect.needs <= records.known for effect in effects)
    case = make_case(records if enough else program())
    problem = build_problem(case, effect_priors(), effects)
    truth = {
        "K": 2.5,
        "E0": 207e3,
        "alpha": 3e-4,
        "force_offset": 1.0,
        "deformation_offset": 0.005,
        "sigma": 0.4,
        **{
            f"{effect.name}.{p}": spec.typical
            for effect in effects
            for p, spec in parameters(effect).items()
        },
    }
    data = simulate(problem, case, truth, jax.random.key(11))
    # Rounding seen as noise shares one variance with sigma: a ridge with a long tail.
    longer = {"warmup": 2000, "draws": 2000} if "quantisation" in names else {}
    found = calibrate(data, effects=names, **(SHORT | longer))
    assert found.usable, found.reasons
    for parameter in (n for n in truth if "." in n):
        low, high = np.quantile(found.draws[parameter], [0.005, 0.995])
        assert low < truth[parameter] < high, parameter


@pytest.mark.thorough
def test_two_specimens_with_a_fixed_K_and_a_coarse_scale():
    """The pilot sees each specimen's slope, so coarse rounding is treated exactly."""
    rng = np.random.default_rng(3)
    specimen = np.repeat([0, 1], 20)
    deformation = np.tile(np.linspace(0.02, 0.54, 20), 2)
    slope = np.array([195.0, 220.0])[specimen]
    force = slope * deformation + rng.normal(0.0, 0.2, 40)
    records = make_records(
        deformation,
        0.98 * np.round(force / 0.98),
        specimen=specimen,
        known={"specimen"},
    )
    gear = make_gear(resolution=0.98, K=Prior("fixed", (2.6,)))
    found = calibrate(make_case(records, gear), **SHORT)
    assert found.problem.rounded
    assert 0.05 < np.median(found.draws["sigma"]) < 0.5
    assert summarise(found)["parameters"]["K"]["driven_by"] == "prior"


def test_an_sd_for_every_row_keeps_the_rows():
    rng = np.random.default_rng(4)
    deformation = rng.uniform(0.02, 0.54, 3000)
    sd = rng.uniform(0.1, 0.5, 3000)
    records = make_records(
        deformation, 205.0 * deformation + sd * rng.normal(size=3000), force_sd=sd
    )
    problem = build_problem(make_case(records), effect_priors())
    assert problem.blocks is None


@pytest.mark.thorough
def test_a_known_sd_by_row_weighs_the_rows():
    """Rows stated to be poor are; ignoring it would move the slope."""
    deformation = np.linspace(0.02, 0.54, 60)
    poor = np.arange(60) % 2 == 0
    rng = np.random.default_rng(2)
    force = 205.0 * deformation + np.where(poor, 10.0, 0.1) * rng.normal(size=60)
    records = make_records(
        deformation, force, force_sd=np.where(poor, 10.0, 0.0), known={"force_sd"}
    )
    found = calibrate(make_case(records), **SHORT)
    assert found.draws["sigma"].mean() < 0.3
    assert found.draws["stiffness"].mean() == pytest.approx(205.0, abs=0.5)
    assert found.draws["stiffness"].std() < 0.3


def test_a_diametral_reading_halves_the_radial_displacement():
    records = with_force(ramp(40))
    radial, diametral = (
        calibrate(make_case(records, make_gear(reading=kind)), **SHORT)
        for kind in ("radial", "diametral")
    )
    ratio = np.median(diametral.draws["K"]) / np.median(radial.draws["K"])
    assert ratio == pytest.approx(2.0, rel=0.02)
    slopes = [np.median(p.draws["stiffness"]) for p in (radial, diametral)]
    assert slopes[0] == pytest.approx(slopes[1], rel=0.005)


def test_a_gap_beside_an_effect_is_integrated_too():
    """Rows are kept for the effect; drawn members must not count in the likelihood."""
    case = make_case(with_force(cycles(48)))
    chosen = choose_effects(["coulomb_friction"])
    form = form_of(case, chosen, True)
    problem = build_problem(case, effect_priors(), chosen, structure=form)
    assert problem.blocks is None
    assert "discrepancy" in problem.integrated
    of_truth, of_members = jax.random.split(jax.random.key(0))
    shared = draw_truth(problem, of_truth)
    drawn = jax.jit(draw_members)(problem, shared, of_members)
    assert set(drawn) == {"gap_weights"}
    assert np.std(drawn["gap_weights"]) > 0.0
    compiled = jax.jit(log_likelihood)
    alone, both = (float(compiled(problem, one)) for one in (shared, shared | drawn))
    assert np.isfinite(alone)
    assert both == alone
