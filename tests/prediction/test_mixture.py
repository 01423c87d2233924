"""Shares and quantiles of a mixture are exact, into the tails and in derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from hdcal.prediction.engine.mixture import (
    Mixture,
    draw_quantiles,
    pooled,
    quantile_weights,
    weighted_quantile,
)

WEIGHT = np.array([0.3, 0.7])
MEAN = np.array([[0.0, 1.0], [5.0, -3.0], [2.0, 2.0]])
SD = np.array([[1.0, 2.0], [0.2, 0.1], [1e-3, 3.0]])
SHARES = (1e-9, 0.01, 0.5, 0.93, 0.99, 1.0 - 1e-6)
# Compiled once, as margins do.
BELOW, ABOVE, QUANTILE = map(jax.jit, (Mixture.below, Mixture.above, Mixture.quantile))


def mixture() -> Mixture:
    return Mixture(jnp.asarray(WEIGHT), jnp.asarray(MEAN), jnp.asarray(SD))


def test_shares_are_those_of_their_parts():
    for force in (-3.0, 0.3, 2.1, 6.0):
        at = jnp.full(3, force)
        below, above = BELOW(mixture(), at), ABOVE(mixture(), at)
        expected = stats.norm.cdf((force - MEAN) / SD) @ WEIGHT
        np.testing.assert_allclose(below, expected, atol=1e-12)
        np.testing.assert_allclose(below + above, 1.0, atol=1e-12)


def test_an_error_beside_it_is_added():
    wide = mixture().widened(0.7)
    np.testing.assert_allclose(wide.sd, np.hypot(SD, 0.7))
    np.testing.assert_array_equal(wide.mean, MEAN)


@pytest.mark.parametrize("share", SHARES)
def test_a_quantile_is_the_inverse_of_the_share(share):
    found = mixture()
    place = QUANTILE(found, share)
    if share > 0.5:
        np.testing.assert_allclose(ABOVE(found, place), 1.0 - share, rtol=1e-7)
    else:
        np.testing.assert_allclose(BELOW(found, place), share, rtol=1e-7)


def test_far_tails_keep_their_digits():
    alone = Mixture(jnp.ones(1), jnp.zeros((1, 1)), jnp.ones((1, 1)))
    for far in (5.0, 10.0, 30.0):
        expected = stats.norm.sf(far)
        assert float(ABOVE(alone, jnp.array([far]))[0]) == pytest.approx(
            expected, rel=1e-9
        )


def test_a_population_without_scatter_is_one_force():
    alone = Mixture(jnp.ones(1), jnp.array([[7.0]]), jnp.zeros((1, 1)))
    assert float(QUANTILE(alone, 0.99)[0]) == pytest.approx(7.0, abs=1e-7)
    assert float(ABOVE(alone, jnp.array([6.9]))[0]) == 1.0
    assert float(ABOVE(alone, jnp.array([7.1]))[0]) == 0.0


def test_derivatives_of_quantiles_agree_with_differences():
    share = jnp.array([0.01, 0.99])

    @jax.jit
    def of(scale):
        made = Mixture(jnp.asarray(WEIGHT), MEAN[:2] * scale, SD[:2] * scale**2)
        return made.quantile(share)

    exact = jax.jit(jax.jacfwd(of))(1.0)
    difference = (of(1.0 + 1e-5) - of(1.0 - 1e-5)) / 2e-5
    np.testing.assert_allclose(exact, difference, rtol=1e-6)


def test_pooled_draws_are_weighed():
    parts = [(jnp.full(3, 0.8 / 3), mixture()), (jnp.full(3, 0.2 / 3), mixture())]
    both = pooled(parts)
    at = jnp.asarray(1.3)
    expected = float(jnp.mean(mixture().below(jnp.full(3, 1.3))))
    assert float(both.below(at)) == pytest.approx(expected, rel=1e-12)


def test_weighted_quantiles_are_those_of_repeated_values():
    rng = np.random.default_rng(0)
    values = rng.normal(size=400)
    counts = rng.integers(1, 5, 400)
    for share in (0.05, 0.5, 0.95):
        found = weighted_quantile(values, counts.astype(float), share)
        used = quantile_weights(values, counts.astype(float), share)
        expected = np.quantile(np.repeat(values, counts), share, method="hazen")
        assert found == pytest.approx(expected, abs=0.02)
        assert used.sum() == pytest.approx(1.0) and used @ values == pytest.approx(
            found
        )
    even = weighted_quantile(values, np.ones(400), 0.9)
    assert even == pytest.approx(np.quantile(values, 0.9, method="hazen"), abs=1e-12)


def test_quantiles_of_many_rows_are_those_of_each():
    rng = np.random.default_rng(1)
    values, weights = rng.normal(size=(400, 3)), rng.uniform(0.5, 2.0, 400)
    shares = np.array([0.05, 0.5, 0.95])
    found = draw_quantiles(values, weights, shares)
    for row, share in np.ndindex(3, 3):
        alone = weighted_quantile(values[:, row], weights, shares[share])
        assert found[share, row] == pytest.approx(alone, rel=1e-12)
