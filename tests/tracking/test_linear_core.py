"""The row-by-row update is what a batch fit of all rows gives."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from hdcal.tracking.linear_core import LinearCore, LinearCores
from hdcal.tracking.normal_inverse_gamma import (
    NormalInverseGamma,
    half_width,
    match_draws,
    normal_score,
)


def make_prior(seed: int = 0) -> NormalInverseGamma:
    """A prior with correlated coefficients of very different sizes."""
    rng = np.random.default_rng(seed)
    size = np.array([4.0, 0.02, 2.0, 0.01])
    root = size[:, None] * np.tril(rng.normal(size=(4, 4)) + 2.0 * np.eye(4))
    return NormalInverseGamma(np.array([200.0, -0.06, -1.0, 0.0]), root, 5.0, 4.0)


def rows(count: int, *, hard: bool, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Linear columns and forces; hard ones hardly differ from each other."""
    rng = np.random.default_rng(seed)
    narrow = 1e-6 if hard else 1.0
    deformation = 0.3 + narrow * rng.uniform(-0.25, 0.25, count)
    rise = 40.0 + narrow * rng.uniform(-50.0, 50.0, count)
    one = np.ones(count)
    design = np.stack([deformation, deformation * rise, one, rise], axis=1)
    return design, design @ [205.0, -0.05, 1.0, 0.02] + rng.normal(0.0, 0.8, count)


def batch(prior: NormalInverseGamma, design, force):
    """All rows at once: stacked least squares, the prior as rows of its own."""
    whiten = np.linalg.inv(prior.root)
    table = np.vstack([whiten, design])
    target = np.concatenate([whiten @ prior.mean, force])
    mean = np.linalg.lstsq(table, target, rcond=None)[0]
    factor = np.linalg.qr(table).R
    covariance = np.linalg.inv(factor) @ np.linalg.inv(factor).T
    rest = target - table @ mean
    return mean, covariance, prior.rate + 0.5 * rest @ rest


def naive(prior: NormalInverseGamma, design, force):
    """The textbook update of a covariance, whose digits cancel."""
    mean, covariance = prior.mean.copy(), prior.root @ prior.root.T
    for row, reading in zip(design, force, strict=True):
        gain = covariance @ row / (1.0 + row @ covariance @ row)
        mean = mean + gain * (reading - row @ mean)
        covariance = covariance - np.outer(gain, row @ covariance)
    return mean, covariance


def follow(prior: NormalInverseGamma, design, force, **settings) -> LinearCore:
    core = LinearCore(prior, **settings)
    for row, reading in zip(design, force.tolist(), strict=True):
        core.step(row, reading)
    return core


def covariance_of(core: LinearCores) -> np.ndarray:
    """Over the noise variance."""
    return core.root @ core.root.mT


@pytest.mark.parametrize(("count", "hard"), [(3, False), (2000, False), (20_000, True)])
def test_it_equals_the_batch_answer(count, hard):
    prior, (design, force) = make_prior(), rows(count, hard=hard)
    core = follow(prior, design, force)
    mean, covariance, rate = batch(prior, design, force)
    found, spread = core.mean, covariance_of(core)
    # In units of the prior, since the coefficients have nothing in common.
    np.testing.assert_allclose(found, mean, rtol=1e-8)
    unit = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        spread / np.outer(unit, unit), covariance / np.outer(unit, unit), atol=1e-8
    )
    assert core.rate == pytest.approx(rate, rel=1e-8)
    assert core.shape == prior.shape + count / 2


def test_a_covariance_update_would_be_caught():
    root = make_prior().root * 1e4
    prior = NormalInverseGamma(make_prior().mean, root, 5.0, 4.0)
    design, force = rows(2000, hard=True)
    mean, _, _ = batch(prior, design, force)
    core_mean = follow(prior, design, force).mean
    size = np.sqrt(np.sum(root**2, axis=1))
    assert np.max(np.abs(core_mean - mean) / size) < 1e-8
    wrong, _ = naive(prior, design, force)
    assert np.max(np.abs(wrong - mean) / size) > 1e-8


def test_its_predictions_multiply_to_the_probability_of_all_rows():
    prior, (design, force) = make_prior(), rows(25, hard=False)
    core, total = LinearCore(prior), 0.0
    for row, reading in zip(design, force.tolist(), strict=True):
        freedom = 2.0 * core.shape
        middle, half, score = core.step(row, reading)
        scale = half / half_width(freedom)
        total += stats.t.logpdf(reading, freedom, middle, scale)
        chance = stats.t.cdf(reading, freedom, middle, scale)
        assert score == pytest.approx(stats.norm.ppf(chance), abs=1e-9)
    within = np.eye(25) + design @ prior.root @ prior.root.T @ design.T
    joint = stats.multivariate_t(
        design @ prior.mean, prior.rate / prior.shape * within, 2.0 * prior.shape
    )
    assert total == pytest.approx(joint.logpdf(force), rel=1e-9)


def scores(noise: float) -> np.ndarray:
    """Normal scores of streams whose truth is drawn from the prior."""
    prior, rng, found = make_prior(), np.random.default_rng(5), []
    for seed in range(60):
        variance = prior.rate / rng.gamma(prior.shape)
        truth = prior.mean + np.sqrt(variance) * prior.root @ rng.normal(size=4)
        design, _ = rows(30, hard=False, seed=seed)
        sd = noise * np.sqrt(variance)
        force = design @ truth + sd * rng.normal(size=30)
        core = LinearCore(prior)
        pairs = zip(design, force.tolist(), strict=True)
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
    rng, like = np.random.default_rng(2), make_prior()
    draws = like.mean + rng.normal(size=(5000, 4)) @ like.root.T
    variance = np.exp(rng.normal(0.3, 0.4, 5000))
    prior = match_draws(draws, variance)
    mean_variance = prior.rate / (prior.shape - 1.0)
    covariance = prior.root @ prior.root.T * mean_variance
    np.testing.assert_allclose(covariance, np.cov(draws.T), rtol=1e-9, atol=1e-15)
    logs = np.log(stats.invgamma(prior.shape, scale=prior.rate).rvs(200_000, 3))
    assert np.mean(logs) == pytest.approx(np.mean(np.log(variance)), abs=0.01)
    assert np.std(logs) == pytest.approx(np.std(np.log(variance)), abs=0.01)


def test_what_never_varies_needs_no_direction():
    rng = np.random.default_rng(2)
    draws = np.tile([200.0, 0.0, 1.0, 0.0], (100, 1))
    draws[:, 0] += rng.normal(size=100)
    prior = match_draws(draws, np.ones(100))
    assert prior.root.shape == (4, 1)
    core = follow(prior, *rows(50, hard=False))
    assert core.coefficient(2)[:2] == (1.0, 0.0)
    assert covariance_of(core)[1:].any() == np.False_


def test_a_widened_coefficient_has_that_much_more_variance():
    core = follow(make_prior(), *rows(40, hard=False))
    before, spread = core.mean.copy(), covariance_of(core)
    core.widen(2, 9.0)
    after, wider = core.mean, covariance_of(core)
    np.testing.assert_allclose(after, before, rtol=1e-9)
    extra = np.zeros((4, 4))
    extra[2, 2] = 9.0 / (core.rate / core.shape)
    np.testing.assert_allclose(wider, spread + extra, rtol=1e-7, atol=1e-12)


def test_many_cores_are_each_as_it_would_be_alone():
    priors = [replace(make_prior(i), rate=i + 1.0) for i in range(3)]
    alone, (design, force) = [LinearCores(p) for p in priors], rows(40, hard=False)
    roots, rates = (
        np.stack([p.root for p in priors]),
        np.array([p.rate for p in priors]),
    )
    many = LinearCores(replace(priors[0], root=roots, rate=rates))
    for i, (row, reading) in enumerate(zip(design, force.tolist(), strict=True)):
        if i == 20:
            many.widen(2, 9.0)
            for core in alone:
                core.widen(2, 9.0)
        middle, scale, _ = many.learn(row, reading)
        found = [core.learn(row, reading)[:2] for core in alone]
        np.testing.assert_allclose([middle, scale], np.transpose(found), rtol=1e-9)
    np.testing.assert_allclose(many.mean, [core.mean for core in alone], rtol=1e-9)
    expected = [core.marginal(0)[1] for core in alone]
    np.testing.assert_allclose(many.marginal(0)[1], expected, rtol=1e-9)


def test_forgetting_is_a_batch_fit_with_fading_weights():
    prior, (design, force) = make_prior(), rows(200, hard=False)
    core = follow(prior, design, force, forget=0.97)
    weight = np.sqrt(0.97 ** np.arange(199, -1, -1))
    left = 0.97**200 + (1.0 - 0.97**200) / 100.0
    wide = NormalInverseGamma(
        prior.mean, prior.root / np.sqrt(left), prior.shape, prior.rate
    )
    mean, _, _ = batch(wide, design * weight[:, None], force * weight)
    np.testing.assert_allclose(core.mean, mean, rtol=1e-8)
    assert core.shape < prior.shape + 0.5 / 0.03 + 1e-9


def test_memory_does_not_grow():
    design, force = rows(3000, hard=False)
    sizes = {
        len(pickle.dumps(follow(make_prior(), design[:n], force[:n])))
        for n in (10, 3000)
    }
    assert len(sizes) == 1


@pytest.mark.parametrize("forget", [1.0, 0.95])
def test_unknowns_that_come_later_are_those_of_the_beginning(forget):
    first, later = follow_with_unknowns(forget, 0), follow_with_unknowns(forget, 15)
    np.testing.assert_allclose(later.mean, first.mean, rtol=1e-6)
    np.testing.assert_allclose(covariance_of(later), covariance_of(first), rtol=1e-6)


def follow_with_unknowns(forget: float, at: int) -> LinearCore:
    """Follow rows of a known noise, of which the last see two unknowns as well."""
    prior = replace(make_prior(), shape=1e8, rate=1e8)
    design, force = rows(40, hard=False)
    core = LinearCore(prior, forget)
    for row in range(40):
        if row == at:
            core.add_unknowns(2)
        own = [] if row < at else [float(row > 20), float(row > 30)]
        core.step(np.append(design[row], own), float(force[row] + sum(own)))
    return core


def test_unknowns_fade_to_what_they_began_with():
    core = LinearCore(make_prior(), 0.9)
    core.add_unknowns(1)
    core.step(np.array([0.3, 0.0, 1.0, 0.0, 5.0]), 70.0)
    for _ in range(400):
        core.fade()
    _, sd, _ = core.coefficient(4)
    expected = LinearCore(make_prior())
    expected.add_unknowns(1)
    assert sd == pytest.approx(expected.coefficient(4)[1], rel=1e-3)
