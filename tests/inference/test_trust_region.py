"""Minima found by Newton's steps, beside SciPy's search of the same kind."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy

import hdcal
from hdcal.inference import laplace
from hdcal.inference.problem import build_problem
from hdcal.inference.trust_region import Secant, _step, expansion, minimise

TOLERANCE = 1e-6


def rosenbrock(x):
    return jnp.sum(100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1.0 - x[:-1]) ** 2)


def saddle(x):
    """Beginning on its ridge: two equal valleys beside it."""
    return 0.25 * x[0] ** 4 - 0.5 * x[0] ** 2 + 0.5 * (x[1] - 1.0) ** 2


def walled(x):
    """Nothing beyond 2, and the minimum at 1."""
    return jnp.sum(x) - 2.0 * jnp.sum(jnp.log(2.0 - x)) + jnp.sum((x - 2.0) ** 2)


FUNCTIONS = {
    "rosenbrock": (rosenbrock, [-1.2, 1.0, 0.5, 3.0]),
    "saddle": (saddle, [0.6, 3.0]),
    "walled": (walled, [-30.0, 1.9]),
}


def of(function):
    with jax.enable_x64(True):
        return jax.jit(lambda x: expansion(function, x))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_minimum_is_scipys(name):
    function, start = FUNCTIONS[name]
    expand, start = of(function), np.array(start)
    with jax.enable_x64(True):
        found = minimise(expand, start, TOLERANCE)
        theirs = scipy.optimize.minimize(
            lambda x: float(expand(x)[0]) if np.isfinite(expand(x)[0]) else np.inf,
            start,
            jac=lambda x: np.nan_to_num(np.asarray(expand(x)[1])),
            hess=lambda x: np.nan_to_num(np.asarray(expand(x)[2])),
            method="trust-exact",
            options={"gtol": TOLERANCE},
        )
        assert np.linalg.norm(expand(found.place)[1]) < TOLERANCE
        np.testing.assert_allclose(found.place, theirs.x, atol=1e-5)
        np.testing.assert_array_equal(found.curve, expand(found.place)[2])


def test_gradients_alone_lead_there_too():
    function, start = FUNCTIONS["rosenbrock"]
    with jax.enable_x64(True):
        slopes = Secant(jax.jit(jax.value_and_grad(function)), 4)
        found = minimise(slopes, np.array(start), TOLERANCE)
        exact = minimise(of(function), found.place, TOLERANCE)
        np.testing.assert_allclose(found.place, exact.place, atol=1e-6)


def test_the_hessian_of_a_quadratic_is_learned():
    root = np.random.default_rng(0).normal(size=(5, 5))
    whole = root @ root.T + np.eye(5)
    bowl = Secant(lambda x: (0.5 * x @ whole @ x, whole @ x), 5)
    found = minimise(bowl, np.ones(5), TOLERANCE)
    np.testing.assert_allclose(found.place, np.zeros(5), atol=1e-6)
    np.testing.assert_allclose(found.curve, whole, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("radius", [0.01, 0.5, 100.0])
@pytest.mark.parametrize("least", [-3.0, 0.0, 2.0])
def test_no_point_within_the_radius_is_lower(least, radius):
    """Against many points of the sphere, and of the ball."""
    rng = np.random.default_rng(1)
    axes = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    curve = axes @ np.diag([least, 1.0, 3.0, 10.0]) @ axes.T
    for pulled in (True, False):
        slope = axes @ np.array([1.0 if pulled else 0.0, 0.5, -1.0, 2.0])
        step, is_short = _step(slope, curve, radius)
        length = np.linalg.norm(step)
        assert length <= radius * (1.0 + 1e-9)
        assert is_short or length == pytest.approx(radius)
        points = rng.normal(size=(20_000, 4))
        points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
        points *= rng.uniform(size=(20_000, 1)) ** 0.25

        lowest, *others = (
            points @ slope + 0.5 * np.sum((points @ curve) * points, axis=1)
            for points in (step[None], points)
        )
        assert lowest <= np.min(others) + 1e-9 * abs(lowest)


def test_where_several_axes_bend_down_alike_and_nothing_pulls_one_is_taken():
    step, _ = _step(np.array([0.0, 0.0, 1.0]), np.diag([-2.0, -2.0, 2.0]), 1.0)
    np.testing.assert_allclose(step[2], -0.25)
    assert np.linalg.norm(step) == pytest.approx(1.0)

    def egg_box(x):
        return jnp.sum(0.25 * x[:2] ** 4 - 0.5 * x[:2] ** 2) + 0.5 * (x[2] - 1.0) ** 2

    with jax.enable_x64(True):
        found = minimise(of(egg_box), np.array([0.0, 0.0, 3.0]), TOLERANCE)
    np.testing.assert_allclose(np.abs(found.place), np.ones(3), atol=1e-6)


def test_what_is_nowhere_finite_stays_where_it_began():
    found = minimise(lambda x: (np.nan, x, np.eye(2)), np.ones(2), TOLERANCE)
    np.testing.assert_array_equal(found.place, np.ones(2))
    np.testing.assert_array_equal(found.curve, np.eye(2))


def test_at_a_bend_it_ends_when_nothing_is_gained():
    counted = []

    def bent(x):
        counted.append(1)
        return abs(x[0]), np.sign(x), np.zeros((1, 1))

    found = minimise(bent, np.array([0.3]), TOLERANCE, patience=(12, 1e-3))
    assert abs(found.place[0]) < 1e-2
    assert len(counted) < 60


@pytest.mark.parametrize("name", ["xb1-100-80", "slit-damper", "thermal-demo"])
def test_the_mode_of_a_posterior_is_scipys(name):
    case = hdcal.read_case(f"datasets/{name}")
    problem = build_problem(case, {}, (), theory=case.gear.theory)
    found = laplace.fit(problem)

    def height(x):
        return laplace.potential(problem, found.position(x))

    expand = jax.jit(lambda x: expansion(height, x))
    start = np.full(len(found.factor), 0.5)
    theirs = scipy.optimize.minimize(
        lambda x: float(expand(x)[0]),
        start,
        jac=lambda x: np.asarray(expand(x)[1]),
        hess=lambda x: np.asarray(expand(x)[2]),
        method="trust-exact",
        options={"gtol": 1e-8},
    )
    np.testing.assert_allclose(theirs.x, np.zeros(len(start)), atol=1e-4)
    np.testing.assert_allclose(theirs.hess, np.eye(len(start)), atol=1e-3)
