"""Draws of a component, whose size may be one of several."""

import numpy as np
import pytest
from rigs import make_case, make_gear, ramp

from hdcal.evidence.linear_problem import linear_problem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import CoefficientPrior, Part, posterior, sampled_curves
from hdcal.physics.registry import EFFECTS

ROWS, DRAWS = 40, 20_000


def wave(*priors: CoefficientPrior) -> Part:
    columns = np.sin(np.linspace(0.0, 9.0, ROWS))[None]
    none = np.zeros(ROWS)
    return Part(0, none, columns, np.zeros(1), np.zeros((0, ROWS)), priors, -1, None, 0)


def test_draws_are_those_of_each_prior_by_its_probability():
    records = ramp(ROWS)
    case = make_case(records, make_gear())
    part = wave(
        CoefficientPrior(0.7, np.array([0.3])), CoefficientPrior(0.3, np.array([5.0]))
    )
    force = 195.0 * np.asarray(records.deformation) + 2.0 * part.columns[0]
    object.__setattr__(case.records, "force", force)
    problem = linear_problem(case, EFFECTS, noise_sd=3.0)
    noise = NoiseModel("", np.ones(ROWS), 0.0, 0.0)
    rng = np.random.default_rng(1)
    drawn = sampled_curves(problem, noise, [part], DRAWS, rng).whole[0]
    mean = square = 0.0
    left = problem.project(part.columns)[0]
    for prior in part.priors:
        found = posterior(problem, noise, [wave(prior)])
        size = prior.sd[0] * found.mean[-1]
        variance = prior.sd[0] ** 2 * np.sum(found.factor[:, -1] ** 2)
        mean += prior.probability * size
        square += prior.probability * (size**2 + variance)
    sizes = drawn @ left / (left @ left)
    error = np.sqrt((square - mean**2) / DRAWS)
    assert sizes.mean() == pytest.approx(mean, abs=4.0 * error)
    assert np.mean(sizes**2) == pytest.approx(square, rel=0.05)
    assert drawn == pytest.approx(sizes[:, None] * left, abs=1e-9)
