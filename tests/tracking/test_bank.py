"""The row-by-row update is what a batch fit of all rows gives."""

import copy
from functools import cache

import jax.numpy as jnp
import numpy as np
import pytest
from equinox import tree_at
from posteriors import single
from scipy import stats
from streams import correlated, with_correlation

from hdcal.tracking.bank import CELLS, STIFFNESS, Bank, _normal_score, _rounding_weight
from hdcal.tracking.tracker import StreamReading, Tracker

STEP = 0.98


@cache
def _tracker() -> Tracker:
    return Tracker(single())


def new_tracker() -> Tracker:
    """Return a tracker before its first row."""
    return copy.copy(_tracker())


def rows(count: int, rho: float, seed: int = 3, width: float = 0.5):
    rng = np.random.default_rng(seed)
    deformation = 0.04 + width * rng.uniform(size=count)
    return deformation, 205.0 * deformation - 0.4 + 0.6 * correlated(rng, rho, count)


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_each_draw_is_a_batch_fit_with_its_marginal_likelihood(rho):
    """Generalised least squares and a multivariate Student density, the slow twin."""
    tracker = with_correlation(new_tracker(), rho)
    before, draws = tracker._bank, tracker._draws
    deformation, force = rows(60, rho)
    for reading in zip(deformation.tolist(), force.tolist(), strict=True):
        answer = tracker.update(*reading)
    after, forces = tracker._bank, draws.at(deformation, np.full(60, 20.0))
    gaps = np.arange(60)
    correlation = rho ** np.abs(gaps[:, None] - gaps)
    density = []
    for draw in range(0, 128, 9):
        mean, slope = (
            np.asarray(forces.mean)[:, draw],
            np.asarray(forces.slope)[:, draw],
        )
        design = np.stack([slope, np.ones(60)], axis=1)
        start = np.asarray(before.mean)[draw, :2]
        prior = np.asarray(before.covariance)[draw, :2, :2]
        left = force - mean + slope - design @ start
        spread = correlation + design @ prior @ design.T
        gain = prior @ design.T @ np.linalg.inv(spread)
        found = np.asarray(after.mean)[draw, :2]
        np.testing.assert_allclose(found, start + gain @ left, rtol=1e-8)
        covariance = np.asarray(after.covariance)[draw, :2, :2]
        np.testing.assert_allclose(covariance, prior - gain @ design @ prior, rtol=1e-6)
        shape, rate = float(before.shape), float(before.rate[draw])
        expected = rate + 0.5 * left @ np.linalg.solve(spread, left)
        assert float(after.rate[draw]) == pytest.approx(expected, rel=1e-9)
        law = stats.multivariate_t(None, rate / shape * spread, 2.0 * shape)
        density.append(law.logpdf(left))
    weight = np.asarray(after.log_weight)[::9]
    np.testing.assert_allclose(
        weight - weight[0], np.subtract(density, density[0]), atol=1e-7
    )
    shares = np.exp(np.asarray(after.log_weight))
    middle = shares @ (draws.stiffness * np.asarray(after.mean)[:, STIFFNESS])
    assert answer["stiffness_N_per_mm"]["mean"] == pytest.approx(middle, rel=1e-12)


def test_rows_that_hardly_differ_keep_their_digits():
    tracker = with_correlation(new_tracker(), 0.0)
    before = tracker._bank
    deformation, force = rows(2_000, 0.0, width=1e-6)
    tracker.follow(
        [
            StreamReading(deformation=x, force=y)
            for x, y in zip(deformation.tolist(), force.tolist(), strict=True)
        ]
    )
    forces = tracker._draws.at(deformation, np.full(len(force), 20.0))
    design = np.stack([np.asarray(forces.slope)[:, 0], np.ones(len(force))], axis=1)
    prior = np.linalg.inv(np.asarray(before.covariance)[0, :2, :2])
    expected = np.linalg.inv(prior + design.T @ design)
    found = np.asarray(tracker._bank.covariance)[0, :2, :2]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_blocks_of_any_size_give_the_same_answers():
    deformation, force = rows(30, 0.3)
    readings = [
        StreamReading(deformation=x, force=y)
        for x, y in zip(deformation.tolist(), force.tolist(), strict=True)
    ]
    together, apart = new_tracker(), new_tracker()
    answers = together.follow(readings)
    for reading, answer in zip(readings, answers, strict=True):
        other = apart.follow([reading])[0]
        for name in ("innovation", "correlation", "alarm_score"):
            assert other[name] == pytest.approx(answer[name], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("freedom", [4.0, 1e6])
def test_scores_of_a_mixture_are_normal_quantiles(freedom):
    bank = tree_at(
        lambda bank: bank.log_weight,
        new_tracker()._bank,
        jnp.log(jnp.full(128, 1 / 128)),
    )
    shift = np.linspace(-0.5, 0.5, 128)
    for t in (-6.0, -1.0, 0.3, 4.0):
        probability = stats.t(freedom).cdf(t + shift).mean()
        expected = stats.norm.ppf(probability)
        assert float(_normal_score(bank, t + shift, freedom)) == pytest.approx(
            expected, abs=0.05
        )
    assert np.isfinite(float(_normal_score(bank, 1e9 + shift, freedom)))


def rounded_bank(noise: float) -> Bank:
    """Return a bank of readings in steps, beside noise of this sd."""
    bank = new_tracker()._bank
    rate = bank.shape * (noise**2 + STEP**2 / 12.0) * jnp.ones(128)
    bank = tree_at(lambda bank: bank.rate, bank, rate)
    bank = tree_at(lambda bank: bank.counts, bank, jnp.zeros(CELLS))
    return tree_at(lambda bank: bank.step, bank, jnp.asarray(STEP))


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
def test_repeated_readings_add_up_to_what_their_mean_says(noise):
    bank, total = rounded_bank(noise), 0.0
    for _ in range(7):
        weight, part, counts = _rounding_weight(bank, 100)
        bank = tree_at(lambda bank: bank.counts, bank, counts)
        total += float(weight)
    share = float(part)
    # Variance of the mean: what repeats, and a share of the rest.
    assert total == pytest.approx(1.0 / (share + (1.0 - share) / 7))
    assert float(_rounding_weight(bank, 200)[0]) == pytest.approx(1.0)
    other = tree_at(lambda bank: bank.epoch, bank, bank.epoch + 1)
    assert float(_rounding_weight(other, 100)[0]) == pytest.approx(1.0)
