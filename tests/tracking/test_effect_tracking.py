"""Effects are followed by weighted draws, or refused with the reason."""

from dataclasses import asdict

import numpy as np
import pytest
import xarray as xr
from rigs import BASE, make_case, program, ramp
from scipy import stats
from structures import form_of

from hdcal.data.priors import effect_priors
from hdcal.errors import InputError
from hdcal.inference.distributions import frozen
from hdcal.inference.posterior import STRUCTURE, Posterior
from hdcal.inference.posterior_tree import dataset
from hdcal.inference.problem import build_problem, problem_priors
from hdcal.physics.registry import EFFECTS
from hdcal.prediction.engine.pooled import pool
from hdcal.tracking import effect_tracking
from hdcal.tracking.normal_inverse_gamma import half_width, match_draws
from hdcal.tracking.stream_prior import prior_from_posterior
from hdcal.tracking.tracker import Tracker

DRAWS = 400


def handmade(names, **spread) -> Posterior:
    """A posterior whose draws are made up, so that nothing has to be sampled."""
    case = make_case(program() if names != ["contact_onset"] else ramp())
    effects = tuple(EFFECTS[name] for name in names)
    shipped = effect_priors()
    priors = problem_priors(case, effects, shipped, "ring")
    problem = build_problem(case, shipped, effects)
    rng = np.random.default_rng(0)
    medians = {name: frozen(prior).median() for name, prior in problem.priors.items()}
    draws = {name: np.full(DRAWS, median) for name, median in medians.items()}
    centre = {"K": 2.4, "E0": 207e3, "alpha": 3e-4, "force_offset": 0.0}
    centre |= {"deformation_offset": 0.0, "sigma": 0.8}
    width = {"K": 0.05, "alpha": 3e-5, "force_offset": 0.5, "sigma": 0.1}
    for name in BASE:
        draws[name] = centre[name] + width.get(name, 0.0) * rng.normal(size=DRAWS)
    for name, (middle, sd) in spread.items():
        draws[name.replace("__", ".")] = middle + sd * rng.normal(size=DRAWS)
    draws["stiffness"] = draws["K"] * draws["E0"] * float(problem.unit_stiffness)
    drawn = dataset({name: values[None] for name, values in draws.items()})
    settings = {"with_gap": False, STRUCTURE: asdict(form_of(case, effects))}
    tree = xr.DataTree.from_dict({"posterior": drawn})
    return Posterior(case, "ring", effects, priors, tree, {}, (), settings)


ONSET = {"contact_onset__ratio": (0.3, 0.05), "contact_onset__onset": (0.25, 0.02)}


@pytest.fixture(scope="module")
def onset() -> Posterior:
    return handmade(["contact_onset"], **ONSET)


def stream(count: int, seed: int = 1):
    rng = np.random.default_rng(seed)
    w = rng.uniform(0.02, 0.54, count)
    force = 194.0 * (w + 0.3 * np.maximum(0.0, w - 0.25))
    return w, force + rng.normal(0.0, 0.8, count)


def test_weights_and_stiffness_are_those_of_a_batch(onset):
    """The slow twin: each draw's marginal likelihood of all rows at once."""
    tracker = Tracker(onset)
    deformation, force = stream(30)
    for reading in zip(deformation.tolist(), force.tolist(), strict=True):
        found = tracker.update(*reading)
    known = pool(onset)
    prior = prior_from_posterior(known)
    core, columns = effect_tracking.build_particles(known, prior, 1.0)
    rows = np.stack([columns(w, 0.0, 0.0) for w in deformation.tolist()], axis=1)
    law = match_draws(prior.coefficients(), prior.variance)
    ratio = law.rate / law.shape
    log, middle = [], []
    for p in range(effect_tracking.PARTICLES):
        (slope, rest, _), (stiffness, _, zero) = rows[p].T, core.mean[p]
        design = np.stack([slope, np.ones(len(force))], axis=1)
        spread = (core.root[p] @ core.root[p].T)[::2, ::2]
        within = np.eye(len(force)) + design @ spread @ design.T
        at = rest + design @ [stiffness, zero]
        student = stats.multivariate_t(at, ratio * within, 2.0 * law.shape)
        log.append(student.logpdf(force))
        precision = np.linalg.inv(spread) + design.T @ design
        pull = design.T @ (force - at)
        middle.append(stiffness + np.linalg.solve(precision, pull)[0])
    weight = np.exp(np.array(log) - np.max(log))
    weight /= weight.sum()
    expected = float(weight @ middle)
    assert found["stiffness_N_per_mm"]["mean"] == pytest.approx(expected, rel=1e-8)
    effective = 1.0 / np.sum(weight**2)
    assert found["effective_particles"] == pytest.approx(effective, rel=1e-6)


def test_few_effective_draws_are_told_and_get_no_interval(onset):
    tracker = Tracker(onset)
    for reading in zip(*(part.tolist() for part in stream(2000)), strict=True):
        found = tracker.update(*reading)
    assert found["degenerate"] and found["effective_particles"] < 5.0
    assert found["stiffness_N_per_mm"]["credible_95"] is None
    fresh = Tracker(onset).update(0.2, 39.0)
    assert not fresh["degenerate"]
    assert fresh["stiffness_N_per_mm"]["credible_95"] is not None


def test_the_force_without_the_effect_is_that_of_the_linear_core():
    none = {"contact_onset__ratio": (0.0, 0.0), "contact_onset__onset": (5.0, 0.0)}
    plain, with_effect = (
        Tracker(handmade([])),
        Tracker(handmade(["contact_onset"], **none)),
    )
    for reading in [(0.1, 19.0), (0.4, 78.0), (0.5, 97.0)]:
        one, other = plain.update(*reading), with_effect.update(*reading)
        for name in ("predicted", "predictive_95"):
            expected = pytest.approx(one["force_N"][name], rel=0.02, abs=0.2)
            assert other["force_N"][name] == expected


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("coulomb_friction", "needs unloading"),
        ("outliers", "shapes the noise"),
        ("charge_leakage", "remembers earlier rows"),
        ("force_saturation", "is not linear in the stiffness"),
    ],
)
def test_what_cannot_be_followed_is_refused(name, words):
    with pytest.raises(InputError, match=words):
        Tracker(handmade([name]), forget=1.0)


def test_every_reason_is_given_at_once():
    with pytest.raises(InputError) as caught:
        Tracker(handmade(["coulomb_friction", "charge_leakage"]), forget=0.9)
    words = str(caught.value)
    assert "coulomb_friction" in words and "charge_leakage" in words
    assert "forget" in words


def test_an_effect_of_temperature_needs_the_temperature():
    tracker = Tracker(handmade(["thermal_zero_drift"]))
    with pytest.raises(ValueError, match="temperature is missing"):
        tracker.update(0.1, 20.0)
    assert tracker.update(0.1, 20.0, temperature=25.0)["row"] == 1


def test_half_of_a_normal_interval_is_the_limit():
    assert half_width(1e9) == pytest.approx(stats.norm.ppf(0.975), rel=1e-6)


GROWING = {"heteroscedastic_noise__share": (0.03, 0.003)}


def test_noise_that_grows_is_taken_at_every_reading():
    """2.4 N beside 0.8 N at 0.4 mm; without a force as without the effect."""
    plain, growing = handmade([]), handmade(["heteroscedastic_noise"], **GROWING)

    def band(known, at: float) -> float:
        found = Tracker(known).update(at, 194.0 * at)["force_N"]["predictive_95"]
        return (found[1] - found[0]) / 3.92

    added = band(growing, 0.4) ** 2 - band(plain, 0.4) ** 2
    assert added == pytest.approx((0.03 * 194.0 * 0.4) ** 2, rel=0.1)
    assert band(growing, 0.0) == pytest.approx(band(plain, 0.0), rel=0.05)


@pytest.mark.parametrize("others", [{}, ONSET])
def test_streams_whose_noise_grows_have_normal_scores(others):
    names = ["heteroscedastic_noise", *(["contact_onset"] if others else [])]
    tracker, rng = (
        Tracker(handmade(names, **GROWING, **others)),
        np.random.default_rng(5),
    )
    w = rng.uniform(0.0, 0.54, 300)
    force = 194.0 * w
    if others:
        force = force + 194.0 * 0.3 * np.maximum(0.0, w - 0.25)
    force = force + rng.normal(0.0, np.hypot(0.8, 0.03 * 194.0 * w))
    scores = np.array(
        [
            tracker.update(*row)["innovation"]
            for row in zip(w.tolist(), force.tolist(), strict=True)
        ]
    )
    for part in (scores[w < 0.15], scores[w > 0.4]):
        assert np.std(part) == pytest.approx(1.0, abs=0.25)


def test_growing_noise_goes_with_forgetting():
    posterior = handmade(["heteroscedastic_noise"], **GROWING)
    assert Tracker(posterior, forget=0.99).update(0.2, 39.0)["row"] == 1
