"""Calibration as a library call: recovery of a known truth, clear when refused."""

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
from hdcal.calibration.calibration import K_by_theory, summarise
from hdcal.data.priors import effect_priors
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder
from hdcal.errors import InputError
from hdcal.inference import laplace
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.posterior import Posterior
from hdcal.physics.effect import parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.registry import EFFECTS


def with_force(records, sd=0.5):
    noise = np.random.default_rng(0).normal(0.0, sd, len(records.force))
    force = 205.0 * np.asarray(records.deformation) - 1.0 + noise
    return replace(records, force=force)


def test_a_posterior_survives_the_disk_and_rebuilds_its_problem(tmp_path):
    posterior = calibrate(make_case(with_force(ramp(40))), seed=4, **SHORT)
    posterior.save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path)
    assert summarise(back) == summarise(posterior)
    assert {*back.tree.children} == {
        "posterior",
        "prior",
        "sample_stats",
        "observed_data",
        "constant_data",
        "log_likelihood",
    }
    pairs = zip(*map(jax.tree.leaves, (back.problem, posterior.problem)), strict=True)
    assert all(np.array_equal(one, other) for one, other in pairs)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"effects": ["coulomb_frction"]}, "Did you mean 'coulomb_friction'"),
        ({"effects": ["coulomb_friction"]}, "needs unloading"),
        ({"effects": ["rig_compliance"]}, "needs readings of the rig alone"),
        ({"effects": "outliers"}, "is not a list"),
        ({"chains": 1}, "chains"),
        ({"warmup": 0}, "warmup"),
        ({"draws": 2}, "draws"),
    ],
)
def test_what_cannot_be_calibrated_is_refused(settings, words):
    with pytest.raises(InputError, match=words):
        calibrate(make_case(with_force(ramp())), **settings)


# The spread of members is a parameter of the model itself, see test_scatter; the
# compliance of the rig is no part of any data: it is the stiffness itself.
WITH_SITES = [
    name
    for name, each in EFFECTS.items()
    if not issubclass(each, Scatter) and name != "rig_compliance"
]
# One of every stage, and one that remembers.
SLICE = ("thermal_expansion", "coulomb_friction", "charge_leakage", "outliers")


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(SLICE, marks=pytest.mark.thorough),
        *(pytest.param((name,), marks=pytest.mark.slow) for name in WITH_SITES),
    ],
)
def test_effects_are_recovered(names):
    """At their typical sizes: the truth is in the 99 % interval."""
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
    }
    sizes = {
        f"{effect.name}.{p}": spec.typical
        for effect in effects
        for p, spec in parameters(effect).items()
    }
    data = simulate(problem, case, truth | sizes, jax.random.key(11))
    # Rounding taken for noise shares one variance with sigma: a ridge with a long tail.
    longer = {"warmup": 2000, "draws": 2000} if "quantisation" in names else {}
    found = calibrate(data, effects=names, **(SHORT | longer))
    assert found.usable, found.reasons
    for parameter, size in sizes.items():
        low, high = np.quantile(found.draws[parameter], [0.005, 0.995])
        assert low < size < high, parameter


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


def test_a_diametral_reading_halves_the_radial_deformation():
    x = np.linspace(0.02, 0.54, 14)
    records = make_records(x, 205.0 * x + 0.5 * np.cos(9.0 * x))
    found = []
    for reading in ("radial", "diametral"):
        case = make_case(records, make_gear(reading=reading))
        problem = build_problem(case, effect_priors())
        mode = laplace.values_at(problem, laplace.fit(problem).centre)
        found.append((float(mode["K"]), float(mode["stiffness"])))
    assert found[1] == pytest.approx((2.0 * found[0][0], found[0][1]), rel=0.01)


def test_drawn_members_do_not_count_in_the_likelihood():
    """Rows are kept for an effect; the discrepancy is integrated out all the same."""
    case, chosen = make_case(with_force(cycles(48))), (EFFECTS["coulomb_friction"],)
    form = form_of(case, chosen, True)
    problem = build_problem(case, effect_priors(), chosen, structure=form)
    assert problem.blocks is None and problem.integrated == ("discrepancy",)
    shared = draw_truth(problem, jax.random.key(0))
    drawn = jax.jit(Problem.draw_members)(problem, shared, jax.random.key(1))
    assert np.std(drawn["gap_weights"]) > 0.0
    compiled = jax.jit(Problem.log_likelihood)
    alone, both = (float(compiled(problem, one)) for one in (shared, shared | drawn))
    assert np.isfinite(alone) and both == alone


@pytest.mark.thorough
def test_every_theory_reads_one_posterior():
    case, size = read_case(datasets_folder() / "xb1-100-80"), SHORT | {"draws": 4000}
    by_ring, by_article = (calibrate(case, theory=t, **size) for t in (None, "article"))
    one, other = K_by_theory(by_ring), K_by_theory(by_article)
    for name, found in one.items():
        assert found.median == pytest.approx(other[name].median, rel=0.005)
    low, middle, high = np.quantile(by_ring.draws["stiffness"], [0.025, 0.5, 0.975])
    assert low < 209.41 < high and middle == pytest.approx(209.41, abs=1.5)
    assert one["article"].lo < 0.1289 * 210.0 / 207.0 < one["article"].hi
