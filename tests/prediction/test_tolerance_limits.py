"""With the reference prior, bounds are the published normal tolerance limits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from hdcal.prediction.engine.mixture import Mixture, weighted_quantile
from hdcal.prediction.shares import check_rarity, check_shares

# One-sided normal factors at 95 % confidence, Owen (1963), Sandia SCR-607; to two
# or three decimals also CMH-17, vol. 1, tables of k_B and k_A.
PUBLISHED = {
    5: (3.407, 5.741),
    10: (2.355, 3.981),
    30: (1.777, 3.064),
}


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


@pytest.mark.parametrize("size", PUBLISHED)
@pytest.mark.parametrize(("column", "content"), [(0, 0.90), (1, 0.99)])
def test_with_the_reference_prior_the_bound_is_the_classical_one(size, column, content):
    published = PUBLISHED[size][column]
    assert bayesian_factor(size, content) == pytest.approx(published, abs=1e-3)
    # A population that is assumed 2 % too narrow is noticed.
    assert abs(bayesian_factor(size, content, narrowed=0.98) - published) > 1e-2


def test_shares_that_cannot_be_asked_for():
    assert [f.file for f in check_shares(content=1.0, confidence=0.0)] == [
        "content",
        "confidence",
    ]
    shares = {"content": 1.0 - 1e-10, "confidence": 0.995}
    findings = check_rarity(shares, draws=1000)
    assert {finding.file for finding in findings} == shares.keys()
    assert not check_rarity({"content": 0.99, "confidence": 0.95}, draws=1000)
