"""Outliers by a bound of the sum over all assignments; noise as it was simulated."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from rigs import make_case, make_gear, ramp
from scipy.special import betaln

from hdcal.evidence.evaluation import Selection
from hdcal.evidence.items import Amplitudes, Atoms
from hdcal.evidence.linear_problem import LinearProblem, linear_problem
from hdcal.evidence.noise_models import (
    PRIOR_ODDS,
    NoiseModel,
    _clustered,
    correlated_noise,
    growing_noise,
    outliers,
)
from hdcal.evidence.parts import Context, posterior
from hdcal.inference.distributions import frozen
from hdcal.physics.registry import EFFECTS

ROWS, NOISE = 9, 0.4


def problem_of(
    error: np.ndarray, order: np.ndarray | None = None, sense: np.ndarray | None = None
) -> LinearProblem:
    """Return a spring with errors, its deformations in some order and direction."""
    records = ramp(len(error))
    case = make_case(records, make_gear())
    if order is not None:
        deformation = np.asarray(records.deformation)[order]
        object.__setattr__(case.records, "deformation", deformation)
    if sense is not None:
        object.__setattr__(case.records, "sense", sense)
    force = 195.0 * np.asarray(case.records.deformation) + 1.0 + error
    object.__setattr__(case.records, "force", force)
    return linear_problem(case, EFFECTS, noise_sd=NOISE)


def _path(step: np.ndarray, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Return deformations by number, and directions, of cycles with so many steps."""
    return np.minimum(step, last - step), np.where(2 * step < last, 1.0, -1.0)


def evidence(problem: LinearProblem, noise: NoiseModel) -> float:
    """Return the log evidence of the base model alone."""
    none, rows = np.zeros(0), np.zeros((0, len(problem.y)))
    index = none.astype(int)
    atoms = Atoms(index, index, index, Amplitudes(*5 * [none]), none, rows, rows)
    loose = np.zeros((0, 1, len(problem.y)))
    selection = Selection(problem, atoms, loose, (), ("outside",))
    return selection.evaluate(noise, Context(np.zeros(len(problem.y)), rows)).none


@pytest.mark.parametrize("wild", [0.0, -6.0])
def test_outliers_are_a_bound_of_the_sum_over_all_assignments(wild: float):
    error = np.random.default_rng(1).normal(0.0, NOISE, ROWS)
    error[4] += wild
    problem = problem_of(error)

    def fitted(weight):
        return posterior(problem, NoiseModel("", weight, 0.0, 0.0), []).reading

    (model,) = outliers(problem, 0.0, fitted)
    bound = evidence(problem, model) - np.log(PRIOR_ODDS)
    a, b = map(float, problem.priors["outliers.fraction"].numbers)
    ratios = frozen(problem.priors["outliers.ratio"]).ppf([1 / 6, 1 / 2, 5 / 6])
    terms = []
    for ratio, some in product(ratios, product((0.0, 1.0), repeat=ROWS)):
        weight = np.where(np.array(some) > 0.0, 1.0 / ratio, 1.0)
        count = sum(some)
        log_prior = betaln(a + count, b + ROWS - count) - betaln(a, b) - np.log(3.0)
        terms.append(evidence(problem, NoiseModel("", weight, 0.0, log_prior)))
    exact = float(np.logaddexp.reduce(terms))
    assert exact - 4.0 < bound < exact + 0.02
    equal = evidence(problem, NoiseModel("", np.ones(ROWS), 0.0, 0.0))
    assert (bound > equal) == (wild != 0.0)


@pytest.mark.parametrize(
    ("place", "sides", "found"),
    [
        ("time", [1.0], False),
        ("deformation", [1.0], False),
        # As in a burst of noise.
        ("time", [1.0, -1.0], True),
        ("random", [1.0], True),
        ("pair", [1.0], True),
    ],
)
def test_outliers_do_not_agree_with_neighbours(place: str, sides: list, found: bool):
    rows, rng = 480, np.random.default_rng(4)
    order = rng.permutation(rows)
    some = {
        "time": np.arange(30, 38),
        "deformation": np.flatnonzero(order // 8 == 3),
        "random": rng.choice(rows, 8, replace=False),
        "pair": np.array([200, 201]),
    }[place]
    error = rng.normal(0.0, NOISE, rows)
    error[some] += 8.0 * np.resize(sides, len(some))
    problem = problem_of(error, order)

    def fitted(weight):
        return posterior(problem, NoiseModel("", weight, 0.0, 0.0), []).reading

    assert bool(outliers(problem, 0.0, fitted)) == found


@pytest.mark.parametrize("lasts", [1, 2])
def test_random_disturbances_are_rarely_structure(lasts: int):
    """Twenty of one sign in 200 rows, of one or two readings; the level is 1 %."""
    rows, rng = 200, np.random.default_rng(6)
    step = np.arange(rows) % 40
    problem = problem_of(np.zeros(rows), *_path(step, 39))
    alarms = 0
    for _ in range(1000):
        wild = np.zeros(rows)
        at = rng.choice(rows - 1, 20, replace=False)
        wild[np.add.outer(np.arange(lasts), at)] = 3.0
        alarms += _clustered(problem, wild)
    # The 99.9 % quantile of the number in 1,000 is 21.
    assert alarms <= 21


def test_a_stated_sd_of_a_reading_makes_it_no_outlier():
    """Every tenth reading scatters ten times as much, as it is stated."""
    rows, rng = 240, np.random.default_rng(2)
    sd = np.where(np.arange(rows) % 10 == rng.integers(10), 10.0 * NOISE, 0.0)
    problem = problem_of(rng.normal(0.0, np.hypot(NOISE, sd)))
    problem = replace(problem, weight=NOISE / np.hypot(NOISE, sd))

    def fitted(weight):
        return posterior(problem, NoiseModel("", weight, 0.0, 0.0), []).reading

    models = outliers(problem, 0.0, fitted)
    np.testing.assert_allclose(models[0].weight / problem.weight, 1.0, atol=0.05)


@pytest.mark.parametrize(
    ("place", "found"),
    [
        ("turn", False),
        ("burst", True),
        ("slow", True),
        ("held", True),
        ("random", True),
    ],
)
def test_outliers_do_not_recur_at_a_place_of_the_cycle(place: str, found: bool):
    """Errors of either side; a burst is at one place too, of one cycle.

    The first cycle may be slow, or a deformation may be held for many rows.
    """
    rows, rng = 480, np.random.default_rng(4)
    step = np.arange(rows) % 60
    if place == "slow":
        step = np.append(np.arange(240) // 4, np.arange(240) % 60)
    order, sense = _path(step, 59)
    if place == "held":
        order = np.minimum(order, 15)
    some = {
        "turn": np.arange(1, rows, 60),
        "burst": np.arange(100, 108),
        "slow": np.arange(100, 108),
        "held": np.arange(78, 86),
        "random": rng.choice(rows, 8, replace=False),
    }[place]
    error = rng.normal(0.0, NOISE, rows)
    error[some] += 8.0 * np.resize([1.0, -1.0], len(some))
    problem = problem_of(error, order, sense)

    def fitted(weight):
        return posterior(problem, NoiseModel("", weight, 0.0, 0.0), []).reading

    assert bool(outliers(problem, 0.0, fitted)) == found


def test_a_correlation_is_that_of_the_errors():
    rng, error = np.random.default_rng(2), np.zeros(4000)
    for row in range(1, len(error)):
        error[row] = 0.7 * error[row - 1] + rng.normal(0.0, NOISE)
    problem = problem_of(error)
    (model,) = correlated_noise(problem, error, (0.6, 0.98))
    assert not correlated_noise(problem, error, (0.7, 0.98))
    assert model.correlation == pytest.approx(0.7, abs=0.04)
    sd = np.sqrt((1.0 - 0.7**2) / len(error))
    assert np.exp(model.log_prior) == pytest.approx(np.sqrt(2.0 * np.pi) * sd, rel=0.1)


def test_noise_that_grows_has_its_variance_and_at_most_its_prior():
    problem = problem_of(np.random.default_rng(3).normal(0.0, NOISE, 30))
    models = growing_noise(problem, 0.2)
    assert sum(np.exp(m.log_prior) for m in models) <= PRIOR_ODDS
    load = np.abs(np.asarray(problem.records.deformation) - 0.0)
    for model in models:
        variance = model.weight**-2.0
        share = np.polyfit((load / load.max()) ** 2, variance, 1)
        fitted = np.polyval(share, (load / load.max()) ** 2)
        assert fitted == pytest.approx(variance, rel=0.05)
        assert np.mean(np.log(variance)) == pytest.approx(0.0, abs=1e-9)
