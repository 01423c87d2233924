"""A reading is as probable as its interval of the noise, in every tail."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr, logsumexp

from hdcal.inference.force_model import likelihood
from hdcal.physics.effect import Noise

log_probability = jax.jit(likelihood.log_probability, static_argnames="rounded")
STEP = 0.98


@pytest.fixture(autouse=True)
def _double():
    jax.config.update("jax_enable_x64", True)


def one(sd, rows):
    return Noise(jnp.zeros(1), jnp.full((1, rows), sd))


def rounded_probability(error, sd, step):
    """Return log P(reading) of errors on a grid of width `step`."""
    found = log_probability(
        error, np.zeros(len(error)), one(sd, len(error)), step, rounded=True
    )
    return np.asarray(found) + np.log(step)


@pytest.mark.parametrize("sd", [0.02, 0.3, 1.0, 7.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_rounding_in_both_tails(sd, side):
    far = np.array([0.0, 0.4, 1.0, 5.0, 12.0, 60.0, 300.0])
    # The lower tail of the normal distribution is exact in logarithms.
    high, low = (log_ndtr((half - far) / sd) for half in (STEP / 2.0, -STEP / 2.0))
    slow = high + np.log1p(-np.exp(low - high))
    found = rounded_probability(side * far, sd, STEP)
    np.testing.assert_allclose(found, slow, rtol=1e-10, atol=1e-12)
    if sd == 0.02:
        assert found[-1] < -1e8


def test_rounding_has_a_finite_slope_in_every_tail():
    def value(mean, log_sd):
        error = jnp.array([0.0, 0.49, -5.0, 5.0, 300.0, -300.0])
        noise = Noise(jnp.zeros(1), jnp.full((1, 6), jnp.exp(log_sd)))
        mean = jnp.full(6, mean)
        return log_probability(error, mean, noise, STEP, rounded=True)

    slope = jax.jit(jax.jacfwd(value, argnums=(0, 1)))
    for log_sd in (-6.0, -1.0, 0.0, 3.0):
        slopes = slope(0.0, log_sd)
        assert np.isfinite(slopes).all()
        # A reading above its mean asks for a larger mean.
        assert slopes[0][4] > 0.0 > slopes[0][5]


@pytest.mark.parametrize("step", [1e-2, 1e-4])
def test_a_fine_step_is_a_density(step):
    error = np.linspace(-8.0, 8.0, 33)
    found = rounded_probability(error, 1.0, step) - np.log(step)
    # The mean over the interval exceeds the middle by q²/24 times φ''/φ.
    limit = stats.norm.logpdf(error) + step**2 * (error**2 - 1.0) / 24.0
    np.testing.assert_allclose(found, limit, rtol=0.0, atol=3.0 * step**4 * 64 + 1e-9)


@pytest.mark.parametrize(("mean", "sd"), [(0.0, 3.0), (-7.77, 0.1)])
def test_probabilities_over_the_grid_sum_to_one(mean, sd):
    grid, sds = STEP * np.arange(-80, 81), np.full((2, 161), [[sd], [2.0 * sd]])
    noise = Noise(jnp.log(jnp.array([0.7, 0.3])), jnp.asarray(sds))
    found = log_probability(grid, np.full(161, mean), noise, STEP, rounded=True)
    assert STEP * np.sum(np.exp(found)) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("rounded", [True, False])
def test_a_mixture_is_the_weighted_sum(rounded):
    rng = np.random.default_rng(2)
    weights = np.array([0.6, 0.3, 0.1])
    sd = rng.uniform(0.3, 4.0, (3, 20))
    mean = rng.normal(0.0, 20.0, 20)
    force = mean + rng.normal(0.0, 2.0, 20)
    noise = Noise(jnp.log(weights), jnp.asarray(sd))
    found = log_probability(force, mean, noise, STEP, rounded=rounded)
    if rounded:
        low, high = force - STEP / 2.0 - mean, force + STEP / 2.0 - mean
        each = np.log((stats.norm.cdf(high / sd) - stats.norm.cdf(low / sd)) / STEP)
    else:
        each = stats.norm.logpdf(force, mean, sd)
    slow = logsumexp(each, axis=0, b=weights[:, None])
    np.testing.assert_allclose(found, slow, rtol=1e-8)


def test_an_interval_has_both_ends_in_a_far_tail():
    low = np.array([-40.0, -25.0, 24.0, 30.0])
    high = low + np.array([0.01, 1.0, 0.02, 3.0])
    # By symmetry the upper tail is the lower one.
    left, right = np.where(low > 0.0, -high, low), np.where(low > 0.0, -low, high)
    upper, lower = log_ndtr(right), log_ndtr(left)
    slow = upper + np.log1p(-np.exp(lower - upper))
    np.testing.assert_allclose(likelihood.log_interval(low, high), slow, rtol=1e-8)


def test_the_precision_of_a_row_is_averaged_over_its_mixture():
    weights, error = np.array([0.8, 0.2]), np.array([0.1, 1.0, 6.0])
    sd = np.array([[0.5, 0.5, 1.0], [2.0, 5.0, 4.0]])
    joint = weights[:, None] * stats.norm.pdf(error, 0.0, sd)
    slow = np.sum(joint / sd**2, axis=0) / joint.sum(axis=0)
    noise = Noise(jnp.log(weights), jnp.asarray(sd))
    np.testing.assert_allclose(likelihood.row_precision(error, noise), slow, rtol=1e-9)


@pytest.mark.parametrize("ratio", [0.05, 1.0])
def test_sheppards_correction_where_the_step_is_fine(ratio):
    """What is left after matching the variance is the uniform's fourth cumulant.

    It is −q⁴/120, which moves log p by −q⁴/2880 s⁻⁴ (x⁴ − 6x² + 3).
    """
    sd = STEP / ratio
    spread = np.hypot(sd, STEP / np.sqrt(12.0))
    x = np.linspace(-3.0, 3.0, 61)
    exact = rounded_probability(x * spread, sd, STEP) - np.log(STEP)
    corrected = stats.norm.logpdf(x * spread, 0.0, spread)
    fourth = (STEP / spread) ** 4 / 2880.0
    left = exact - corrected
    expected = -fourth * (x**4 - 6.0 * x**2 + 3.0)
    # The sixth cumulant is next, q⁶/252.
    sixth = (STEP / spread) ** 6 / (252.0 * 720.0)
    assert np.max(np.abs(left - expected)) < 800.0 * (sixth + fourth**2) + 1e-11
    without = exact - stats.norm.logpdf(x * spread, 0.0, sd)
    assert np.max(np.abs(left)) < 0.03 * np.max(np.abs(without))
