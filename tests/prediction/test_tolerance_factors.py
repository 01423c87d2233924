"""The bounds agree with published tolerance factors and sample sizes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from hdcal.errors import InputError
from hdcal.prediction.engine.mixture import Mixture, weighted_quantile
from hdcal.prediction.tolerance_factors import k_factor, wilks_size

# One-sided normal factors at 95 % confidence, Owen (1963), Sandia SCR-607; to two
# or three decimals also CMH-17, vol. 1, tables of k_B and k_A.
PUBLISHED = {
    5: (3.407, 5.741),
    10: (2.355, 3.981),
    20: (1.926, 3.295),
    30: (1.777, 3.064),
    50: (1.646, 2.862),
    100: (1.527, 2.684),
}


@pytest.mark.parametrize("size", PUBLISHED)
def test_classical_factors_are_the_published_ones(size):
    b, a = PUBLISHED[size]
    assert k_factor(size, 0.90, 0.95) == pytest.approx(b, abs=6e-4)
    assert k_factor(size, 0.99, 0.95) == pytest.approx(a, abs=6e-4)


def test_the_handbook_example():
    # NIST/SEMATECH e-Handbook, 7.2.6.3: n = 43, p = 0.90, γ = 0.99.
    assert k_factor(43, 0.90, 0.99) == pytest.approx(1.8740, abs=1e-4)


def reference_posterior(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and sd given a sample of mean 0 and sd 1 under the prior 1/σ."""
    points = qmc.Sobol(2, seed=1).random_base2(18)
    points = np.clip(points, 1e-12, 1.0 - 1e-12)
    sd = np.sqrt((size - 1) / stats.chi2.ppf(points[:, 0], size - 1))
    return sd / np.sqrt(size) * stats.norm.ppf(points[:, 1]), sd


def bayesian_factor(size: int, content: float, *, narrowed=1.0) -> float:
    mean, sd = reference_posterior(size)
    population = Mixture(
        jnp.ones(1), jnp.asarray(mean)[:, None], narrowed * jnp.asarray(sd)[:, None]
    )
    found = np.asarray(jax.jit(Mixture.quantile)(population, content))
    return weighted_quantile(found, np.ones(len(found)), 0.95)


@pytest.mark.parametrize("size", [5, 10, 30])
@pytest.mark.parametrize("content", [0.90, 0.99])
def test_with_the_reference_prior_the_bound_is_the_classical_one(size, content):
    classical = k_factor(size, content, 0.95)
    assert bayesian_factor(size, content) == pytest.approx(classical, abs=1e-3)
    # What parity must notice: a population believed too narrow by 2 %.
    assert abs(bayesian_factor(size, content, narrowed=0.98) - classical) > 1e-2


def test_wilks_sizes_are_the_published_ones():
    one = [(0.90, 29), (0.95, 59), (0.99, 299)]
    assert [(p, wilks_size(p, 0.95)) for p, _ in one] == one
    two = [(0.90, 46), (0.95, 93), (0.99, 473)]
    assert [(p, wilks_size(p, 0.95, sides=2)) for p, _ in two] == two


def test_one_less_than_wilks_is_not_enough():
    for content in (0.90, 0.99):
        size = wilks_size(content, 0.95)
        assert 1.0 - content**size >= 0.95 > 1.0 - content ** (size - 1)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: k_factor(1),
        lambda: k_factor(10, 1.0),
        lambda: k_factor(10, 0.9, 0.0),
        lambda: wilks_size(0.0),
        lambda: wilks_size(0.9, 0.95, sides=3),
    ],
)
def test_what_has_no_factor_is_refused(ask):
    with pytest.raises(InputError):
        ask()


def test_everything_wrong_is_said_at_once():
    with pytest.raises(InputError) as caught:
        k_factor(0, 99.0, 95.0)
    assert len(caught.value.findings) == 3
