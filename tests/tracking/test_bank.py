"""The row-by-row update is what a batch fit of all rows gives."""

import copy
from functools import cache

import numpy as np
import pytest
from posteriors import single
from scipy import stats
from streams import correlated, with_correlation

from hdcal.tracking.bank import STIFFNESS
from hdcal.tracking.tracker import StreamReading, Tracker


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
