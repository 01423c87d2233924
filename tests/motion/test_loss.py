"""What takes the energy of a swing is named, or it is said that it cannot be told."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from jax.flatten_util import ravel_pytree
from moving import TRUTH, frictional_case, motion, moving_case, moving_gear

from hdcal import InputError, Prior, calibrate_dynamic, respond
from hdcal.inference import laplace
from hdcal.inference.checks import Check
from hdcal.inference.distributions import distribution, frozen
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.model_average import load_models
from hdcal.inference.posterior_tree import data_groups, dataset
from hdcal.motion import loss
from hdcal.motion.dynamic_calibration import highest_peak
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.dynamic_priors import FRICTION, dynamic_site_priors
from hdcal.motion.dynamic_problem import build_dynamic
from hdcal.motion.summary import found_loss
from hdcal.physics.effects.loops import CoulombFriction

# Enough to look at, far too few for their checks.
FEW = {"chains": 2, "warmup": 100, "draws": 50}
# Damping ratio and friction [N] of each truth, and the model that holds it.
TRUTHS = {
    "viscous": (0.02, 0.0),
    "dry friction": (0.0, 2.0),
    "both": (0.01, 1.0),
}


def chosen(case, effects=None) -> loss.Chosen:
    """Return the model that would be sampled."""
    linear = build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")
    mode, _ = highest_peak(linear)
    return loss.choose_loss(case, "ring", linear, mode, effects)


def at_mode(found: loss.Chosen, name: str) -> float:
    """Return a parameter where the density is highest."""
    return float(laplace.values_at(found.problem, found.whitening.centre)[name])


@pytest.fixture(scope="module")
def asked() -> loss.Chosen:
    """The model with friction of a record that has both losses."""
    return chosen(frictional_case(100, *TRUTHS["both"]), ["coulomb_friction"])


@pytest.fixture
def always(monkeypatch):
    """Weigh also where the linear model leaves noise and friction would show."""
    monkeypatch.setattr(loss, "PLAIN", np.inf)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("viscous", marks=pytest.mark.slow),
        pytest.param("dry friction", marks=pytest.mark.slow),
        pytest.param("both", marks=pytest.mark.thorough),
    ],
)
def test_a_loss_is_named(name: str, always):
    ratio, friction = TRUTHS[name]
    found = chosen(frictional_case(100, ratio, friction))
    assert found.probabilities[name] >= 0.9
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    # What is sampled unasked is the linear model, and said to be.
    assert found.problem.effects == ()
    outcomes = ["passed"] if name == "viscous" else ["passed", "warning"]
    assert [check.outcome for check in found.checks] == outcomes


@pytest.mark.thorough
def test_friction_that_was_asked_for_is_found(asked):
    assert at_mode(asked, "damping_ratio") == pytest.approx(0.01, rel=0.1)
    assert at_mode(asked, FRICTION) == pytest.approx(1.0, rel=0.05)


@pytest.mark.thorough
def test_an_evidence_without_the_priors_breadth_is_told_by_a_wrong_name(
    monkeypatch, always
):
    evidence = laplace.log_evidence

    def without(problem, found):
        """Take friction as believed to within what the data resolve."""
        if not problem.effects:
            return evidence(problem, found)
        size = float(laplace.values_at(problem, found.centre)[FRICTION])
        prior = frozen(problem.priors[FRICTION]).logpdf(size)
        return evidence(problem, found) - prior - np.log(problem.units[FRICTION])

    monkeypatch.setattr(laplace, "log_evidence", without)
    found = chosen(frictional_case(100, *TRUTHS["viscous"]))
    assert found.probabilities["viscous"] < 0.9


@pytest.mark.slow
def test_names_of_many_records():
    wrong = told = 0
    for seed in range(200, 215):
        for name, (ratio, friction) in TRUTHS.items():
            shares = chosen(frictional_case(seed, ratio, friction)).probabilities
            shares = shares or {"viscous": 1.0}
            likeliest = max(shares, key=lambda n: shares[n])
            told += shares[likeliest] >= 0.9
            wrong += shares[likeliest] >= 0.9 and likeliest != name
    assert told >= 36 and wrong <= 1, (told, wrong)


@pytest.mark.thorough
def test_long_records_keep_the_linear_model_and_say_so(monkeypatch):
    monkeypatch.setattr(loss, "MOST_ROWS", 100)
    found = chosen(frictional_case(0, *TRUTHS["both"]))
    assert found.problem.effects == () and not found.probabilities
    assert [check.outcome for check in found.checks] == ["note"]


@pytest.mark.thorough
def test_where_the_linear_model_leaves_noise_nothing_is_weighed():
    found = chosen(moving_case(0))
    assert found.problem.effects == () and not found.probabilities
    assert [(c.name, c.outcome) for c in found.checks] == [(loss.LOOKED, "passed")]
    frictional = chosen(frictional_case(0, *TRUTHS["both"]), [])
    values = laplace.values_at(frictional.problem, frictional.whitening.centre)
    assert loss.noise_probability(frictional.problem, values) < 1e-3


def test_noise_that_hides_a_gear_that_rubs_is_no_proof_of_damping(monkeypatch):
    case = frictional_case(0, *TRUTHS["dry friction"])
    blur = np.random.default_rng(0).normal(0.0, 0.02, 200)
    read = np.asarray(case.records.deformation) + blur
    hidden = replace(case, records=replace(case.records, deformation=read))
    linear = chosen(hidden, [])
    values = laplace.values_at(linear.problem, linear.whitening.centre)
    assert loss.noise_probability(linear.problem, values) > loss.WHITE
    # Not weighed for its length, it has no name either.
    monkeypatch.setattr(loss, "MOST_ROWS", 100)
    found = chosen(hidden)
    assert [(c.name, c.outcome) for c in found.checks] == [(loss.LOOKED, "note")]


def test_rows_that_are_too_far_apart_for_friction_are_said():
    case = frictional_case(0, *TRUTHS["both"])
    time = np.array(case.records.time)
    time[120:] += 0.01
    gappy = replace(case, records=replace(case.records, time=time))
    with pytest.raises(InputError, match="half a period"):
        chosen(gappy, ["coulomb_friction"])


@pytest.mark.thorough
def test_a_search_begins_inside_of_its_priors():
    stated = moving_gear(damping_ratio=Prior("uniform", (0.015, 0.2), "1"))
    found = chosen(frictional_case(0, 0.02, 1.0, stated), ["coulomb_friction"])
    assert np.isfinite(found.whitening.factor).all()
    assert at_mode(found, FRICTION) == pytest.approx(1.0, rel=0.2)


@pytest.mark.thorough
def test_the_density_with_friction_is_that_of_the_stated_priors(asked):
    """Its coordinate is where the gear would stop."""
    problem = asked.problem
    names = [n for n, prior in problem.priors.items() if prior.family != "fixed"]

    def off(position):
        flat, unravel = ravel_pytree(position)
        values = laplace.values_at(problem, position)
        stated = log_likelihood(problem, values)
        for name in names:
            law = distribution(problem.priors[name], name)
            stated = stated + law.log_prob(values[name])
        moved = jax.jacfwd(
            lambda at: jnp.stack(
                [laplace.values_at(problem, unravel(at))[name] for name in names]
            )
        )(flat)
        moved = jnp.linalg.slogdet(moved)[1]
        return -laplace.potential(problem, position) - stated - moved

    rng = np.random.default_rng(0)
    many = {
        name: np.asarray(at) + 0.02 * rng.normal(size=6)
        for name, at in asked.whitening.centre.items()
    }
    many["initial_velocity"] = many["initial_velocity"] + 40.0 * rng.normal(size=6)
    apart = np.asarray(jax.jit(jax.vmap(off))(many))
    np.testing.assert_allclose(apart - apart[0], 0.0, atol=1e-6)


def test_the_evidence_of_a_normal_density_is_its_integral(monkeypatch):
    factor = np.array([[0.3, 0.0], [0.5, 2.0]])
    precision = np.linalg.inv(factor @ factor.T)

    def potential(_, at):
        return 3.0 + 0.5 * np.einsum("...i,ij,...j", at, precision, at)

    grid = np.linspace(-25.0, 25.0, 2001)
    places = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1)
    whole = np.sum(np.exp(-potential(None, places))) * (grid[1] - grid[0]) ** 2
    monkeypatch.setattr(laplace, "potential", potential)
    found = laplace.Whitening(np.zeros(2), factor)  # pyright: ignore
    assert laplace.log_evidence(None, found) == pytest.approx(np.log(whole), abs=1e-6)


def test_without_effects_nothing_is_weighed():
    found = chosen(moving_case(0), [])
    assert found.problem.effects == () and not found.probabilities and not found.checks


def test_an_effect_that_the_model_does_not_hold_is_refused():
    with pytest.raises(InputError, match="does not hold 'hysteresis'"):
        calibrate_dynamic(moving_case(0), effects=["hysteresis", "coulomb_friction"])


@pytest.mark.slow
def test_a_stated_friction_of_any_family_is_taken():
    gear = moving_gear()
    for prior in (Prior("fixed", (1.0,), "N"), Prior("uniform", (0.5, 3.0), "N")):
        stated = replace(gear, effect_priors={FRICTION: prior})
        case = frictional_case(0, 0.01, 1.0, stated)
        found = chosen(case, ["coulomb_friction"])
        assert at_mode(found, FRICTION) == pytest.approx(1.0, rel=0.05)


@pytest.fixture(scope="module")
def posterior() -> DynamicPosterior:
    """A calibration with friction whose draws are made about the truth by hand."""
    ratio, friction = TRUTHS["both"]
    case = frictional_case(100, ratio, friction)
    truth = TRUTH | {"damping_ratio": ratio}
    gear = motion(truth, case)
    values = truth | gear._asdict() | {FRICTION: friction, "alpha": 3e-4}
    values |= {"warm_stiffness": gear.stiffness, "initial_velocity": 0.0}
    values["initial_deformation"] = 40.0 / gear.stiffness
    values["natural_frequency"] = np.sqrt(gear.stiffness / gear.mass) / (2.0 * np.pi)
    rng, scalars = np.random.default_rng(0), {}
    for name, value in values.items():
        scalars[name] = value * (1.0 + 0.01 * rng.standard_normal((2, 50)))
    stats = dataset({"diverging": np.zeros((2, 50), bool)})
    groups = {"posterior": dataset(scalars), "sample_stats": stats}
    tree = xr.DataTree.from_dict(groups | data_groups(case.records))
    settings = {"with_gap": False, "seed": 0, "seconds": 0.0}
    settings |= {"chains": 2, "warmup": 1, "draws": 50, "versions": {}}
    settings |= {"target_acceptance": 0.8}
    checks = (Check("by hand", "passed", "told to"),)
    priors = dynamic_site_priors(case, "ring", (CoulombFriction,))
    about = (CoulombFriction,), priors, tree, {}, checks, settings
    return DynamicPosterior(case, "ring", *about)


@pytest.mark.slow
def test_the_friction_is_sampled():
    case = frictional_case(0, 0.01, 1.0, rows=96)
    found = calibrate_dynamic(case, effects=["coulomb_friction"], **FEW)
    low, high = np.quantile(found.draws[FRICTION], [0.001, 0.999])
    assert low <= 1.0 <= high and high - low < 0.5


def test_the_friction_is_kept_and_taken_along(posterior, tmp_path):
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_models(tmp_path, [DynamicPosterior])
    assert [effect.name for effect in loaded.effects] == ["coulomb_friction"]
    assert np.array_equal(loaded.draws[FRICTION], posterior.draws[FRICTION])
    moved = respond(loaded, "step", amplitude=40.0, duration=0.02, points=51, draws=20)
    assert moved.effects == ("coulomb_friction",)


def test_the_share_of_dry_friction_is_told(posterior):
    found = found_loss(posterior)
    assert found.name is None and found.probabilities == {}
    # 4 f A and π c ω A² of 0.2 mm: f = 1 N, ζ = 0.01 at 350 Hz.
    assert found.dry_share is not None
    expected = 4.0 / (4.0 + np.pi * 2 * 0.01 * 195 * 0.2)
    assert found.dry_share.median == pytest.approx(expected, rel=0.1)


def weighed(posterior, shares: dict, noise: str = "passed") -> DynamicPosterior:
    """Return a posterior with probabilities and checks made by hand."""
    settings = {**posterior.settings, "loss": shares}
    checks = (Check(loss.LEFT_OVER, noise, "by hand"),)  # pyright: ignore
    return replace(posterior, settings=settings, checks=checks)


def test_a_linear_model_that_leaves_noise_is_named(posterior):
    """And only where dry friction would have shown."""
    for white in ("passed", "warning"):
        for looked in ("passed", "note"):
            checks = (
                Check(loss.WHITENESS, white, "by hand"),
                Check(loss.LOOKED, looked, "by hand"),  # pyright: ignore
            )
            found = found_loss(replace(posterior, effects=(), checks=checks))
            named = white == looked == "passed"
            assert found.name == ("viscous" if named else None)
            assert found.probabilities == {}


@pytest.mark.parametrize("name", TRUTHS)
def test_a_name_needs_nine_tenths_and_residuals_of_noise(name, posterior):
    rest = dict.fromkeys(TRUTHS, 0.04) | {name: 0.92}
    found = found_loss(weighed(posterior, rest))
    assert found.name == name
    assert found_loss(weighed(posterior, rest, "warning")).name is None
    torn = weighed(posterior, dict.fromkeys(TRUTHS, 0.1) | {name: 0.8})
    assert found_loss(torn).name == "cannot tell"


def test_a_friction_left_out_is_told_by_the_damping():
    case = frictional_case(0, 0.01, 1.0)
    found = chosen(case, [])
    true = 2.0 * 0.01 * np.sqrt(at_mode(found, "stiffness") * TRUTH["mass"])
    assert at_mode(found, "damping") > 3.0 * true
