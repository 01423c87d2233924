"""The row-by-row update is what a batch fit of all rows gives."""

import pickle

import numpy as np
import pytest
from scipy import stats

from hdcal.tracking.linear_core import (
    LinearCore,
    Start,
    half_width,
    match,
    normal_score,
)


def make_start(seed: int = 0) -> Start:
    """A prior with correlated coefficients of very different sizes."""
    rng = np.random.default_rng(seed)
    size = np.array([4.0, 0.02, 2.0, 0.01])
    root = size[:, None] * np.tril(rng.normal(size=(4, 4)) + 2.0 * np.eye(4))
    return Start(np.array([200.0, -0.06, -1.0, 0.0]), root, 5.0, 4.0)


def rows(count: int, *, hard: bool, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Linear columns and forces; hard ones hardly differ from each other."""
    rng = np.random.default_rng(seed)
    narrow = 1e-6 if hard else 1.0
    deformation = 0.3 + narrow * rng.uniform(-0.25, 0.25, count)
    rise = 40.0 + narrow * rng.uniform(-50.0, 50.0, count)
    one = np.ones(count)
    design = np.stack([deformation, deformation * rise, one, rise], axis=1)
    return design, design @ [205.0, -0.05, 1.0, 0.02] + rng.normal(0.0, 0.8, count)


def batch(start: Start, design, force):
    """All rows at once: stacked least squares, the prior as rows of its own."""
    whiten = np.linalg.inv(start.root)
    table = np.vstack([whiten, design])
    target = np.concatenate([whiten @ start.mean, force])
    mean = np.linalg.lstsq(table, target, rcond=None)[0]
    factor = np.linalg.qr(table).R
    covariance = np.linalg.inv(factor) @ np.linalg.inv(factor).T
    rest = target - table @ mean
    return mean, covariance, start.rate + 0.5 * rest @ rest


def naive(start: Start, design, force):
    """The textbook update of a covariance, whose digits cancel."""
    mean, covariance = start.mean.copy(), start.root @ start.root.T
    for row, reading in zip(design, force, strict=True):
        gain = covariance @ row / (1.0 + row @ covariance @ row)
        mean = mean + gain * (reading - row @ mean)
        covariance = covariance - np.outer(gain, row @ covariance)
    return mean, covariance


def follow(start: Start, design, force, **settings) -> LinearCore:
    core = LinearCore(start, **settings)
    for row, reading in zip(design.tolist(), force.tolist(), strict=True):
        core.step(row, reading)
    return core


@pytest.mark.parametrize(
    ("count", "hard"), [(3, False), (2000, False), (100_000, True)]
)
def test_it_equals_the_batch_answer(count, hard):
    start, (design, force) = make_start(), rows(count, hard=hard)
    core = follow(start, design, force)
    mean, covariance, rate = batch(start, design, force)
    found, spread = core.moments()
    # In units of the prior, since the coefficients have nothing in common.
    np.testing.assert_allclose(found, mean, rtol=1e-8)
    unit = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        spread / np.outer(unit, unit), covariance / np.outer(unit, unit), atol=1e-8
    )
    assert core.rate == pytest.approx(rate, rel=1e-8)
    assert core.shape == start.shape + count / 2


def test_a_covariance_update_would_be_caught():
    root = make_start().root * 1e4
    start = Start(make_start().mean, root, 5.0, 4.0)
    design, force = rows(2000, hard=True)
    mean, _, _ = batch(start, design, force)
    core_mean, _ = follow(start, design, force).moments()
    size = np.sqrt(np.sum(root**2, axis=1))
    assert np.max(np.abs(core_mean - mean) / size) < 1e-8
    wrong, _ = naive(start, design, force)
    assert np.max(np.abs(wrong - mean) / size) > 1e-8


def test_its_predictions_multiply_to_the_probability_of_all_rows():
    start, (design, force) = make_start(), rows(25, hard=False)
    core, total = LinearCore(start), 0.0
    for row, reading in zip(design.tolist(), force.tolist(), strict=True):
        freedom = 2.0 * core.shape
        middle, half, score = core.step(row, reading)
        scale = half / half_width(freedom)
        total += stats.t.logpdf(reading, freedom, middle, scale)
        chance = stats.t.cdf(reading, freedom, middle, scale)
        assert score == pytest.approx(stats.norm.ppf(chance), abs=1e-9)
    within = np.eye(25) + design @ start.root @ start.root.T @ design.T
    joint = stats.multivariate_t(
        design @ start.mean, start.rate / start.shape * within, 2.0 * start.shape
    )
    assert total == pytest.approx(joint.logpdf(force), rel=1e-9)


def scores(noise: float) -> np.ndarray:
    """Normal scores of streams whose truth is drawn from the start."""
    start, rng, found = make_start(), np.random.default_rng(5), []
    for seed in range(60):
        variance = start.rate / rng.gamma(start.shape)
        truth = start.mean + np.sqrt(variance) * start.root @ rng.normal(size=4)
        design, _ = rows(30, hard=False, seed=seed)
        sd = noise * np.sqrt(variance)
        force = design @ truth + sd * rng.normal(size=30)
        core = LinearCore(start)
        pairs = zip(design.tolist(), force.tolist(), strict=True)
        found += [core.step(row, reading)[2] for row, reading in pairs]
    return np.array(found)


def test_scores_are_standard_normal_if_the_start_is_right():
    assert stats.kstest(scores(1.0), "norm").pvalue > 0.01
    right = scores(1.0).reshape(60, 30)
    assert abs(np.mean(right[:, 1:] * right[:, :-1])) < 4.0 / np.sqrt(right.size)
    assert stats.kstest(scores(0.5), "norm").pvalue < 1e-6


@pytest.mark.parametrize("t", [-300.0, -3.0, 0.0, 2.0, 1e9])
def test_a_score_keeps_its_tails(t):
    score = normal_score(t, 8.0)
    tail = stats.t.sf(abs(t), 8.0)
    assert np.isfinite(score)
    assert np.sign(score) == np.sign(t)
    assert stats.norm.sf(abs(score)) == pytest.approx(tail, rel=1e-9)


def test_a_match_has_the_moments_of_the_draws():
    rng, like = np.random.default_rng(2), make_start()
    draws = like.mean + rng.normal(size=(5000, 4)) @ like.root.T
    variance = np.exp(rng.normal(0.3, 0.4, 5000))
    start = match(draws, variance)
    mean_variance = start.rate / (start.shape - 1.0)
    covariance = start.root @ start.root.T * mean_variance
    np.testing.assert_allclose(covariance, np.cov(draws.T), rtol=1e-9, atol=1e-15)
    logs = np.log(stats.invgamma(start.shape, scale=start.rate).rvs(200_000, 3))
    assert np.mean(logs) == pytest.approx(np.mean(np.log(variance)), abs=0.01)
    assert np.std(logs) == pytest.approx(np.std(np.log(variance)), abs=0.01)


def test_what_never_varies_needs_no_direction():
    rng = np.random.default_rng(2)
    draws = np.tile([200.0, 0.0, 1.0, 0.0], (100, 1))
    draws[:, 0] += rng.normal(size=100)
    start = match(draws, np.ones(100))
    assert start.root.shape == (4, 1)
    core = follow(start, *rows(50, hard=False))
    assert core.coefficient(2)[:2] == (1.0, 0.0)
    assert core.moments()[1][1:].any() == np.False_


def test_a_widened_coefficient_has_that_much_more_variance():
    core = follow(make_start(), *rows(40, hard=False))
    before, spread = core.moments()
    core.widen(2, 9.0)
    after, wider = core.moments()
    np.testing.assert_allclose(after, before, rtol=1e-9)
    extra = np.zeros((4, 4))
    extra[2, 2] = 9.0 / (core.rate / core.shape)
    np.testing.assert_allclose(wider, spread + extra, rtol=1e-7, atol=1e-12)


def test_forgetting_is_a_batch_fit_with_fading_weights():
    start, (design, force) = make_start(), rows(200, hard=False)
    core = follow(start, design, force, forget=0.97)
    weight = np.sqrt(0.97 ** np.arange(199, -1, -1))
    left = 0.97**200 + (1.0 - 0.97**200) / 100.0
    wide = Start(start.mean, start.root / np.sqrt(left), start.shape, start.rate)
    mean, _, _ = batch(wide, design * weight[:, None], force * weight)
    np.testing.assert_allclose(core.moments()[0], mean, rtol=1e-8)
    assert core.shape < start.shape + 0.5 / 0.03 + 1e-9


def test_memory_does_not_grow():
    design, force = rows(3000, hard=False)
    sizes = {
        len(pickle.dumps(follow(make_start(), design[:n], force[:n])))
        for n in (10, 3000)
    }
    assert len(sizes) == 1
