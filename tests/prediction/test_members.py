"""Quantiles and shares of normal components within draws, and weighted draws."""

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from hdcal.prediction.members import Members, joined, one_member, over_draws

SHARE = np.array([[0.3, 0.7], [0.5, 0.5], [1.0, 0.0]])
MEAN = np.array([[[0.0, 1.0]], [[5.0, -3.0]], [[2.0, 9.0]]])
SD = np.array([[[1.0, 2.0]], [[0.2, 0.1]], [[0.5, 3.0]]])


def members(scale: float = 1.0) -> Members:
    """Return three draws at one condition, of two components."""
    variance = {"noise": np.arange(3.0)[:, None]}
    common = {"gear": np.arange(3.0)[:, None], "bend": np.zeros((3, 1))}
    weight = np.array([0.2, 0.3, 0.5])
    return Members(weight, SHARE, scale * MEAN, scale * SD, variance, common)


def below(force: float) -> np.ndarray:
    return np.sum(SHARE * stats.norm.cdf((force - MEAN[:, 0]) / SD[:, 0]), axis=1)


@pytest.mark.parametrize("force", [-3.0, 0.3, 2.1, 6.0])
def test_the_share_above_is_that_of_the_components(force: float):
    found = 1.0 - members().above(force)[:, 0]
    np.testing.assert_allclose(found, below(force), atol=1e-15)


@pytest.mark.parametrize("level", [1e-6, 0.01, 0.5, 0.93, 0.99, 1.0 - 1e-6])
def test_a_quantile_is_the_inverse_of_the_share(level: float):
    place = members().quantile(level)
    tail = min(level, 1.0 - level)
    above = members().above(place)[:, 0]
    found = above if level > 0.5 else 1.0 - above
    np.testing.assert_allclose(found, tail, rtol=1e-5)
    one = Members(np.ones(1), np.ones((1, 1)), np.full((1, 1, 1), 7.0), SD[:1, :, :1])
    assert one.quantile(level)[0, 0] == pytest.approx(stats.norm.ppf(level, 7.0, 1.0))


def test_members_without_scatter_are_one_force():
    same = Members(
        np.ones(1), np.full((1, 2), 0.5), np.full((1, 1, 2), 7.0), np.zeros((1, 1, 2))
    )
    assert same.quantile(0.99)[0, 0] == pytest.approx(7.0, abs=1e-6)
    assert same.above(6.9)[0, 0] == 1.0 and same.above(7.1)[0, 0] == 0.0


def test_one_member_of_each_draw_has_the_law_of_the_members():
    many = Members(
        np.ones(40_000), *(np.repeat(v[1:2], 40_000, axis=0) for v in (SHARE, MEAN, SD))
    )
    even = (np.arange(40_000) + 0.5) / 40_000
    rng = np.random.default_rng(2)
    levels, scores = rng.permutation(even), stats.norm.ppf(rng.permutation(even))
    found = many.sample(levels, scores)[:, 0]
    for level in (0.05, 0.3, 0.8, 0.99):
        expected = members().quantile(level)[1, 0]
        assert np.quantile(found, level) == pytest.approx(expected, abs=0.02)


def test_one_member_over_all_draws_is_the_weighted_mixture():
    found = one_member(members(), 0.4)
    assert found.mean.shape == (1, 1, 6)
    wide = np.hypot(SD[:, 0], 0.4)
    for force in (-1.0, 2.0, 4.0):
        each = np.sum(SHARE * stats.norm.sf((force - MEAN[:, 0]) / wide), axis=1)
        expected = members().weight @ each
        assert found.above(force)[0, 0] == pytest.approx(expected, rel=1e-12)


def test_joined_draws_keep_their_quantiles_and_what_all_have():
    single = Members(
        np.full(2, 0.5),
        np.ones((2, 1)),
        np.full((2, 1, 1), 3.0),
        np.full((2, 1, 1), 2.0),
        common={"gear": np.ones((2, 1))},
    )
    found = joined([members(), single])
    assert found.mean.shape == (5, 1, 2) and found.common.keys() == {"gear"}
    assert found.common["gear"][:, 0].tolist() == [0.0, 1.0, 2.0, 1.0, 1.0]
    for level in (0.01, 0.5, 0.99):
        parts = [members().quantile(level), single.quantile(level)]
        expected = np.concatenate(parts)
        np.testing.assert_allclose(found.quantile(level), expected, atol=1e-6)
    centres = [members().centre, single.centre]
    np.testing.assert_allclose(found.centre, np.concatenate(centres))
    assert joined([single]) is single


def test_quantiles_over_draws_are_those_of_repeated_values():
    rng = np.random.default_rng(0)
    values, counts = rng.normal(size=(400, 3)), rng.integers(1, 5, 400)
    levels = np.array([0.05, 0.5, 0.95])
    even = over_draws(values, np.full(400, 0.1), levels)
    expected = np.quantile(values, levels, axis=0, method="hazen")
    np.testing.assert_allclose(even, expected, rtol=1e-12)
    weighted = over_draws(values, counts / counts.sum(), levels)
    repeated = np.quantile(np.repeat(values, counts, axis=0), levels, axis=0)
    np.testing.assert_allclose(weighted, repeated, atol=0.02)
    # Equal weights that differ by rounding give the same quantiles.
    nearly = 1.0 + 1e-12 * rng.normal(size=400)
    np.testing.assert_allclose(over_draws(values, nearly, levels), even, atol=1e-9)


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
    members = Members(
        np.full(len(sd), 1.0 / len(sd)),
        np.ones((len(sd), 1)),
        mean[:, None, None],
        narrowed * sd[:, None, None],
    )
    return float(over_draws(members.quantile(content), members.weight, [0.95])[0, 0])


@pytest.mark.parametrize("size", PUBLISHED)
@pytest.mark.parametrize(("column", "content"), [(0, 0.90), (1, 0.99)])
def test_the_bound_is_the_classical_one(size: int, column: int, content: float):
    published = PUBLISHED[size][column]
    assert factor(size, content) == pytest.approx(published, abs=1e-3)
    # A population that is assumed 2 % too narrow is noticed.
    assert abs(factor(size, content, 0.98) - published) > 1e-2
