"""Quantiles and shares of normal components within draws."""

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from hdcal.prediction.members import Members, one_member, over_draws

SHARE = np.array([[0.3, 0.7], [0.5, 0.5], [1.0, 0.0]])
MEAN = np.array([[[0.0, 1.0]], [[5.0, -3.0]], [[2.0, 9.0]]])
SD = np.array([[[1.0, 2.0]], [[0.2, 0.1]], [[0.5, 3.0]]])


MEMBERS = Members(SHARE, MEAN, SD)


def below(force: float) -> np.ndarray:
    return np.sum(SHARE * stats.norm.cdf((force - MEAN[:, 0]) / SD[:, 0]), axis=1)


def test_a_quantile_is_the_inverse_of_the_share():
    for force in (-3.0, 0.3, 6.0):
        found = 1.0 - MEMBERS.above(force)[:, 0]
        np.testing.assert_allclose(found, below(force), atol=1e-15)
    for level in (1e-6, 0.01, 0.93, 1.0 - 1e-6):
        place = MEMBERS.quantile(level)[:, 0]
        above = np.diag(np.squeeze([MEMBERS.above(force) for force in place]))
        found = above if level > 0.5 else 1.0 - above
        np.testing.assert_allclose(found, min(level, 1.0 - level), rtol=1e-5)
    one = Members(np.ones((1, 1)), np.full((1, 1, 1), 7.0), SD[:1, :, :1])
    assert one.quantile(0.9)[0, 0] == pytest.approx(stats.norm.ppf(0.9, 7.0, 1.0))


def test_members_without_scatter_are_one_force():
    same = Members(np.full((1, 2), 0.5), np.full((1, 1, 2), 7.0), np.zeros((1, 1, 2)))
    assert same.quantile(0.99)[0, 0] == pytest.approx(7.0, abs=1e-6)
    assert same.above(6.9)[0, 0] == 1.0 and same.above(7.1)[0, 0] == 0.0


def test_one_member_over_all_draws_is_their_mixture():
    """Also where each draw has a level of its own."""
    found, wide = one_member(MEMBERS, 0.4), np.hypot(SD[:, 0], 0.4)
    for force in (-1.0, 2.0, 4.0):
        each = np.sum(SHARE * stats.norm.sf((force - MEAN[:, 0]) / wide), axis=1)
        assert found.above(force)[0, 0] == pytest.approx(each.mean(), rel=1e-12)
    parts = (np.repeat(v, 2000, axis=0) for v in (SHARE, MEAN, SD))
    levels = np.random.default_rng(2).permuted(np.linspace(0.0, 1.0, 6002)[1:-1])
    drawn = Members(*parts).quantile(levels)[:, 0]
    for level in (0.05, 0.8):
        expected = one_member(MEMBERS).quantile(level)[0, 0]
        assert np.quantile(drawn, level) == pytest.approx(expected, abs=0.2)


# --- classical tolerance limits ---

# One-sided normal factors at 95 % confidence, Owen (1963), Sandia SCR-607; to two
# or three decimals also CMH-17, vol. 1, tables of k_B and k_A.
PUBLISHED = {5: (3.407, 5.741), 10: (2.355, 3.981), 30: (1.777, 3.064)}


def factor(size: int, content: float, narrowed: float = 1.0) -> float:
    """Return the bound on a sample of mean 0 and sd 1 under the prior 1/σ."""
    points = qmc.Sobol(2, seed=1).random_base2(18)
    points = np.clip(points, 1e-12, 1.0 - 1e-12)
    sd = np.sqrt((size - 1) / stats.chi2.ppf(points[:, 0], size - 1))
    mean = sd / np.sqrt(size) * stats.norm.ppf(points[:, 1])
    spread = narrowed * sd[:, None, None]
    members = Members(np.ones((len(sd), 1)), mean[:, None, None], spread)
    return float(over_draws(members.quantile(content), [0.95])[0, 0])


@pytest.mark.parametrize("size", PUBLISHED)
@pytest.mark.parametrize(("column", "content"), [(0, 0.90), (1, 0.99)])
def test_the_bound_is_the_classical_one(size: int, column: int, content: float):
    published = PUBLISHED[size][column]
    assert factor(size, content) == pytest.approx(published, abs=1e-3)
    # A population that is assumed 2 % too narrow is noticed.
    assert abs(factor(size, content, 0.98) - published) > 1e-2
