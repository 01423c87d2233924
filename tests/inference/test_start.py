"""The search of the mode begins inside every prior, whatever values are known."""

import jax
import numpy as np
import pytest
from rigs import make_case, make_gear, make_records, ramp

from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.inference import laplace
from hdcal.inference.force_model.problem import Problem, build_problem


def problem_with(zero: Prior) -> Problem:
    x, rng = ramp(14).deformation, np.random.default_rng(0)
    records = make_records(x, 205.0 * x + rng.normal(0.0, 0.5, len(x)))
    gear = make_gear(force_offset=zero)
    return build_problem(make_case(records, gear), effect_priors())


@pytest.mark.parametrize(
    ("zero", "low", "high"),
    [
        (Prior("normal", (0.0, 2000.0)), -5.0, 5.0),
        # The known value, the mean reading, is no possible one.
        (Prior("uniform", (-1.0, 1.0)), -1.0, 1.0),
        (Prior("uniform", (5.0, 9.0)), 5.0, 9.0),
        # Its median is not known in closed form.
        (Prior("beta", (2.0, 3.0)), 0.0, 1.0),
    ],
)
def test_a_search_finds_the_mode_under_any_prior(zero: Prior, low, high):
    problem = problem_with(zero)
    mode = laplace.fit(problem)
    assert low < laplace.values_at(problem, mode.centre)["force_offset"] < high
    slope = jax.grad(lambda at: laplace.potential(problem, mode.position(at)))
    np.testing.assert_allclose(slope(np.zeros(len(mode.factor))), 0.0, atol=1e-4)


def test_a_known_value_of_a_site_that_the_model_lacks_is_left_out():
    problem = problem_with(Prior("fixed", (0.0,)))
    assert "_centre_force" in problem.start
    assert "_centre_force" not in laplace.fit(problem).centre
