"""The one formula equals dense multivariate normal densities."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from rigs import cycles, make_case, make_gear
from scipy import integrate
from scipy.stats import multivariate_normal

from hdcal.evidence import marginal
from hdcal.evidence.evaluation import Selection
from hdcal.evidence.items import Amplitudes, Atoms, Space
from hdcal.evidence.linear_problem import LinearProblem, linear_problem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context, posterior
from hdcal.evidence.projection import Projection
from hdcal.evidence.table import OUTSIDE, EvidenceTable

ROWS, NOISE, NAMES = 24, 0.4, ("one", "other", "outside")
CLOSE = 1e-3


def small_problem() -> LinearProblem:
    records = cycles(ROWS)
    noise = np.random.default_rng(4).normal(0.0, NOISE, ROWS)
    case = make_case(records, make_gear())
    force = 195.0 * records.deformation + 1.0 + noise
    object.__setattr__(case.records, "force", force)
    return linear_problem(case, {}, noise_sd=NOISE)


PROBLEM = small_problem()
BEND = 2.0 * np.sin(6.0 * np.asarray(PROBLEM.records.deformation))
COLUMNS = np.random.default_rng(1).normal(size=(3, ROWS))


def serial_correlation(noise: NoiseModel) -> np.ndarray:
    run = np.cumsum(PROBLEM.before < 0)
    lag = np.abs(np.subtract.outer(np.arange(ROWS), np.arange(ROWS)))
    return np.where(run[:, None] == run, noise.correlation**lag, 0.0)


def dense(noise: NoiseModel, offset=0.0, columns=None, held=None) -> float:
    """Return the log evidence of a Gaussian model, the noise sd on a fine grid.

    Args:
        noise: model of the noise, whose sd is integrated over.
        offset: fixed contribution [N].
        columns: of unit prior sd.
        held: columns whose prior sd grows with the noise, as that of the base.
    """
    serial, sd = serial_correlation(noise), 1.0 / noise.weight
    base = PROBLEM.X if held is None else np.concatenate([PROBLEM.X, held.T], axis=1)
    unit = sd[:, None] * serial * sd + base @ base.T / NOISE**2
    loose = np.zeros((ROWS, ROWS)) if columns is None else columns.T @ columns
    log_sd = np.log(NOISE) + np.linspace(-1.6, 1.6, 129)
    terms = [
        multivariate_normal.logpdf(
            PROBLEM.y - offset, cov=np.exp(2.0 * each) * unit + loose
        )
        + PROBLEM.noise_prior.logpdf(np.exp(each))
        + each
        for each in log_sd
    ]
    whole = integrate.simpson(np.exp(np.array(terms) - max(terms)), x=log_sd)
    return float(np.log(whole) + max(terms)) + noise.log_prior


def evaluated(noise: NoiseModel, context: Context | None = None):
    """Return two atoms, a normal one and one that is flat in a cell, and a space."""
    none = np.zeros(2)
    amplitude = Amplitudes(
        low=np.array([-np.inf, 0.5]),
        high=np.array([np.inf, 1.5]),
        mean=none,
        precision=np.array([1.0, 0.0]),
        log_height=np.array([-0.5 * np.log(2.0 * np.pi), 0.0]),
    )
    owner, shape = np.array([0, 1]), np.zeros(2, int)
    curves = np.zeros((2, ROWS)), np.stack([BEND, BEND])
    atoms = Atoms(owner, shape, owner, amplitude, none, *curves)
    space = Space(2, COLUMNS, np.array([0.3]), np.zeros(1))
    loose = np.zeros((2, 1, ROWS))
    selection = Selection(PROBLEM, atoms, loose, (space,), NAMES)
    empty = Context(np.zeros(ROWS), np.zeros((0, ROWS)))
    return selection.evaluate(noise, context or empty)


@pytest.fixture
def fine(monkeypatch) -> None:
    """Integrate over the noise sd with many nodes."""
    nodes, weights = np.polynomial.hermite.hermgauss(25)
    monkeypatch.setattr(marginal, "_NODES", nodes)
    monkeypatch.setattr(marginal, "_WEIGHTS", weights)


WEIGHT = np.random.default_rng(2).uniform(0.5, 1.5, ROWS)


@pytest.fixture(params=[(np.ones(ROWS), 0.0), (WEIGHT, 0.6)], ids=["equal", "serial"])
def noise(request) -> NoiseModel:
    weight, correlation = request.param
    return NoiseModel("", weight, correlation, -0.7)


def test_base_alone(noise, fine):
    assert evaluated(noise).none == pytest.approx(dense(noise), abs=CLOSE)


def test_normal_amplitude(noise, fine):
    found = evaluated(noise).totals()[0]
    assert found == pytest.approx(dense(noise, columns=BEND[None]), abs=CLOSE)


def test_amplitude_flat_in_a_cell(noise, fine):
    sizes = np.linspace(0.5, 1.5, 41)
    log = np.array([dense(noise, size * BEND) for size in sizes])
    mean = np.log(integrate.simpson(np.exp(log - log.max()), x=sizes)) + log.max()
    assert evaluated(noise).totals()[1] == pytest.approx(mean, abs=CLOSE)


def test_space(noise, fine):
    found = evaluated(noise).totals()[2]
    assert found == pytest.approx(dense(noise, columns=0.3 * COLUMNS), abs=CLOSE)


def test_space_beside_a_context(noise, fine):
    context = Context(0.2 * BEND, 0.5 * BEND[None])
    found = evaluated(noise, context)
    alone = dense(noise, 0.2 * BEND, held=context.columns)
    beside = dense(noise, 0.2 * BEND, 0.3 * COLUMNS, held=context.columns)
    assert found.none == pytest.approx(alone, abs=CLOSE)
    assert found.totals()[2] == pytest.approx(beside, abs=CLOSE)


def test_the_posterior_of_the_base_is_that_of_linear_regression(noise):
    found = posterior(PROBLEM, noise, [])
    same = np.arange(ROWS)
    lag = noise.correlation ** np.abs(np.subtract.outer(same, same))
    run = np.cumsum(PROBLEM.before < 0)
    sd = NOISE / noise.weight
    precision = np.linalg.inv(
        sd[:, None] * np.where(run[:, None] == run, lag, 0.0) * sd
    )
    X = PROBLEM.X
    covariance = np.linalg.inv(X.T @ precision @ X + np.eye(X.shape[1]))
    np.testing.assert_allclose(found.factor.T @ found.factor, covariance, rtol=1e-8)
    mean = covariance @ X.T @ precision @ PROBLEM.y
    np.testing.assert_allclose(found.mean, mean, rtol=1e-8, atol=1e-10)


def test_prior_probabilities_of_all_hypotheses_add_up():
    names = (*"abcde", OUTSIDE)
    table = EvidenceTable(names, [])
    keys = [key for size in range(3) for key in combinations(names[:-1], size)]
    keys += [(*key, OUTSIDE) for key in keys]
    total = sum(np.exp(table.log_prior(key)) for key in keys)
    assert total == pytest.approx(1.0, abs=1e-12)


def test_few_nodes_are_enough(noise, monkeypatch):
    few = evaluated(noise)
    nodes, weights = np.polynomial.hermite.hermgauss(25)
    monkeypatch.setattr(marginal, "_NODES", nodes)
    monkeypatch.setattr(marginal, "_WEIGHTS", weights)
    many = evaluated(noise)
    assert few.none == pytest.approx(many.none, abs=0.01)
    assert few.totals() == pytest.approx(many.totals(), abs=0.02)


def test_rows_that_are_left_out_tell_nothing():
    """The evidence is that of the other rows alone."""
    left_out = np.arange(ROWS) >= ROWS - 5
    rest = PROBLEM.without(left_out)
    weight = np.where(left_out, 0.0, PROBLEM.weight)
    noise = NoiseModel("", weight, 0.6, 0.0)
    empty = Context(np.zeros(ROWS), np.zeros((0, ROWS)))
    found = Projection(rest, noise, empty)
    changed = replace(rest, y=rest.y + 100.0 * left_out)
    again = Projection(changed, noise, empty)
    assert rest.count == ROWS - 5
    assert found.square == pytest.approx(again.square, rel=1e-12)
    assert found.constant == pytest.approx(again.constant, rel=1e-12)
    short = replace(
        PROBLEM,
        y=PROBLEM.y[:-5],
        X=PROBLEM.X[:-5],
        weight=PROBLEM.weight[:-5],
        before=PROBLEM.before[:-5],
    )
    alone = NoiseModel("", short.weight, 0.6, 0.0)
    few = Context(np.zeros(ROWS - 5), np.zeros((0, ROWS - 5)))
    expected = Projection(short, alone, few)
    assert found.square == pytest.approx(expected.square, rel=1e-12)
    assert found.constant == pytest.approx(expected.constant, rel=1e-12)
