"""Importance sampling draws from the posterior, or returns nothing."""

import jax
import numpy as np
import numpyro
import numpyro.distributions as dist
import pandas as pd
import pytest
from scipy import stats

import hdcal
from hdcal.data.prior import Prior
from hdcal.data.resources import datasets_folder
from hdcal.fleets.fleet_problem import fleet_problem
from hdcal.fleets.readings import fleet_readings
from hdcal.inference import importance, laplace
from hdcal.inference.diagnostics import mixing
from hdcal.inference.importance import sample_by_importance
from hdcal.inference.sample import sample
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


def quarter_off():
    """Return gears of which every third is off: two readings of the population."""
    rng, x, parts = np.random.default_rng(0), np.linspace(0.05, 0.5, 10), []
    stiffness = 200.0 * (1.0 + 0.01 * rng.standard_normal(12))
    stiffness[::3] *= 0.96
    for gear, one in enumerate(stiffness):
        for run in range(2):
            noise = 0.6 * rng.standard_normal() + 0.4 * rng.standard_normal(len(x))
            force = one * x + 1.0 + noise
            columns = {"deformation_mm": x, "force_N": force}
            parts.append(pd.DataFrame({"gear": f"G{gear}", "run": run, **columns}))
    return hdcal.read_case(pd.concat(parts, ignore_index=True), theory="spring")


@pytest.mark.slow
@pytest.mark.parametrize("which", ["fleet-demo", "many off"])
def test_a_fleet_is_what_nuts_has_it_whatever_the_seed(which):
    demo = which == "fleet-demo"
    case = hdcal.read_case(datasets_folder() / which) if demo else quarter_off()
    problem, _ = fleet_problem(fleet_readings(case))
    whitening = laplace.fit(problem, {"stiffness": 200.0})
    each = [
        sample_by_importance(problem, whitening, seed, chains=4, draws=2000)
        for seed in range(6)
    ]
    drawn = [found.values for found in each if found is not None]
    assert len(drawn) >= 2
    # All of them together: what single ones leave out would be missing here too.
    fast = {n: np.concatenate([one[n] for one in drawn]) for n in drawn[0]}
    slow = sample(problem, whitening, 0, chains=4, warmup=800, draws=4000).values
    well = [mixing(draws) for draws in (fast, slow)]
    for name, values in slow.items():
        share = np.array([0.025, 0.25, 0.5, 0.75, 0.975])
        ends = np.quantile(fast[name], share)
        apart = np.mean(values.reshape(-1, 1) <= ends, axis=0) - share
        sizes = [min(mixed[name].ess_bulk, mixed[name].ess_tail) for mixed in well]
        error = np.sqrt(share * (1.0 - share) * sum(1.0 / size for size in sizes))
        assert np.all(np.abs(apart) < 4.0 * error), name
