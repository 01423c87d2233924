"""Slack and the point of first contact trade: sampled well, and as the priors say."""

import jax
import numpy as np
import pytest
from rigs import make_case, make_gear, make_records
from stated_density import base_places, off_the_stated_density

from hdcal import EFFECTS, calibrate
from hdcal.data.priors import Prior, effect_priors
from hdcal.inference import model
from hdcal.inference.problem import build_problem

SLACK, NAMES = "seating_slack", ["E0", "K", "alpha", "force_offset", "sigma"]
NAMES += ["deformation_offset", "seating_slack.clearance"]
INDEPENDENT = {"noise_correlation": Prior("fixed", (0.0,))}


def slack_case(seed: int, slack: float = 0.02, **settings):
    """Return readings of a gear with slack, loaded and unloaded."""
    up = np.linspace(0.02, 0.54, 20)
    along = np.concatenate([up, up[::-1]])
    noise = np.random.default_rng([9, seed]).normal(0.0, 0.3, 40)
    force = 205.0 * np.maximum(along - slack, 0.0) - 1.0 + noise
    return make_case(make_records(along, force), make_gear(**settings))


def off(problem) -> np.ndarray:
    """Return by how much the sampled density is off, at random places, one removed."""
    rng = np.random.default_rng(0)
    coordinates = {
        **base_places(rng),
        "_corner": 0.02 * rng.normal(size=8),
        "sigma": rng.normal(size=8),
        "_seating_slack.clearance": 3.0 * rng.normal(size=8),
    }
    return off_the_stated_density(problem, NAMES, coordinates)


@pytest.mark.parametrize("reading", ["radial", "diametral"])
def test_the_density_is_that_of_the_stated_priors(reading: str):
    case = slack_case(0, reading=reading, **INDEPENDENT)
    problem = build_problem(case, effect_priors(), (EFFECTS[SLACK],))
    # Far from the data the densities themselves reach 1e6.
    np.testing.assert_allclose(off(problem), 0.0, atol=1e-4)


@pytest.mark.thorough
def test_a_coordinate_that_forgets_the_slack_is_told(monkeypatch):
    def forgetful(name, prior, scale, _):
        return unmoved(name, prior, scale, 0.0)

    unmoved = model._scaled_and_moved
    monkeypatch.setattr(model, "_scaled_and_moved", forgetful)
    jax.clear_caches()
    problem = build_problem(
        slack_case(0, **INDEPENDENT), effect_priors(), (EFFECTS[SLACK],)
    )
    found = off(problem)
    jax.clear_caches()
    assert np.abs(found).max() > 0.1


@pytest.mark.thorough
def test_little_slack_is_sampled_well():
    found = calibrate(slack_case(1), effects=[SLACK], seed=1)
    assert found.usable, found.reasons
    low, high = np.quantile(found.draws["stiffness"], [0.025, 0.975])
    assert low < 205.0 < high
