"""Importance sampling draws from the posterior, or returns nothing."""

import jax
import numpy as np
import numpyro
import numpyro.distributions as dist
import pytest
from scipy import stats

from hdcal.data.prior import Prior
from hdcal.inference import importance, laplace
from hdcal.inference.importance import sample_by_importance
from hdcal.inference.sampled_problem import Sampled


class Skew(Sampled):
    """Two sites: a gamma, and a normal whose centre follows it."""

    priors: dict[str, Prior]

    def declare(self) -> None:
        """Declare it."""
        size = numpyro.sample("size", dist.Gamma(5.0))
        numpyro.sample("place", dist.Normal(2.0 * size, 1.0))


class Tails(Sampled):
    """A site whose tails are Cauchy's."""

    priors: dict[str, Prior]

    def declare(self) -> None:
        """Declare it."""
        numpyro.sample("place", dist.Cauchy(0.0, 1.0))


class Funnel(Sampled):
    """A scale of eight numbers, of which nothing was measured."""

    priors: dict[str, Prior]

    def declare(self) -> None:
        """Declare it."""
        scale = numpyro.sample("scale", dist.HalfNormal(1.0))
        for place in range(8):
            numpyro.sample(f"place_{place}", dist.Normal(0.0, scale))


class Hills(Sampled):
    """Two modes of one weight, far apart."""

    priors: dict[str, Prior]

    def declare(self) -> None:
        """Declare it."""
        mixture = dist.MixtureSameFamily(
            dist.Categorical(np.array([0.5, 0.5])),
            dist.Normal(np.array([-20.0, 20.0]), 1.0),
        )
        for place in range(3):
            numpyro.sample(f"place_{place}", mixture)


@pytest.fixture(autouse=True)
def _double():
    jax.config.update("jax_enable_x64", True)


def drawn(problem, seed=0, chains=4, draws=800):
    whitening = laplace.fit(problem)
    return sample_by_importance(problem, whitening, seed, chains=chains, draws=draws)


def first_drawn(problem, **size):
    """Return draws by the first seed by which there are any."""
    found = (drawn(problem, seed, **size) for seed in range(8))
    return next(draws for draws in found if draws is not None)


def test_draws_have_a_skewed_distribution_and_follow_the_seed():
    found, again = first_drawn(Skew({}), draws=2000), first_drawn(Skew({}), draws=2000)
    assert np.array_equal(found.values["size"], again.values["size"])
    # Thinned to what is nearly independent.
    size, place = (found.values[name][:, ::4].ravel() for name in ("size", "place"))
    assert stats.kstest(size, stats.gamma(5.0).cdf).pvalue > 0.001
    assert stats.kstest(place - 2.0 * size, stats.norm.cdf).pvalue > 0.001


def test_wrong_weights_would_be_noticed(monkeypatch):
    def equal(problem, whitening, proposals, place, progress=None):
        noise = 1e-3 * np.random.default_rng(0).random(len(place))
        return (1.0 + noise) / np.sum(1.0 + noise)

    monkeypatch.setattr(importance, "_weights", equal)
    size = first_drawn(Skew({}), draws=2000).values["size"].ravel()
    assert stats.kstest(size, stats.gamma(5.0).cdf).pvalue < 1e-6


@pytest.mark.parametrize("problem", [Funnel({}), Hills({})])
def test_what_proposals_do_not_cover_is_not_drawn(problem):
    assert [drawn(problem, seed) for seed in range(3)] == [None] * 3


def test_tails_heavier_than_any_proposal_are_drawn_right_or_not_at_all():
    drawn_at_all = [found for seed in range(6) if (found := drawn(Tails({}), seed))]
    assert drawn_at_all
    place = np.concatenate([found.values["place"][:, ::8] for found in drawn_at_all])
    assert stats.kstest(place.ravel(), stats.cauchy.cdf).pvalue > 0.001
