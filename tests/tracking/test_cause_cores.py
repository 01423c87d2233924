"""Each cause keeps the law of its own draws; rare ones go with the likeliest."""

import numpy as np
import pytest

from hdcal.tracking.cause_cores import followed_one_by_one, laws_given, told_apart
from hdcal.tracking.particles import Particles

RNG = np.random.default_rng(4)
# Two causes: the second has a wider first number, another middle and half the noise.
CAUSE = np.repeat([0, 1], [3000, 1000])
SD = np.where(CAUSE[:, None] == 0, [1.0, 0.2, 0.0], [3.0, 0.2, 0.5])
LINEAR = 10.0 * CAUSE[:, None] + SD * RNG.normal(size=(4000, 3))
VARIANCE = np.where(CAUSE == 0, 1.0, 0.25) * np.exp(0.1 * RNG.normal(size=4000))


def covariance(law, core: int) -> np.ndarray:
    """Return that of the coefficients under the mean of σ²."""
    noise = law.rate[core] / (law.shape - 1.0)
    return law.root[core] @ law.root[core].T * noise


def test_each_core_has_mean_covariance_and_noise_of_its_cause():
    core = followed_one_by_one(LINEAR, VARIANCE, CAUSE)
    assert core.weight == pytest.approx([0.75, 0.25])
    for number in (0, 1):
        own = LINEAR[number == CAUSE]
        np.testing.assert_allclose(core.prior.mean[number], own.mean(axis=0))
        found = covariance(core.prior, number)
        np.testing.assert_allclose(found, np.cov(own.T), rtol=1e-9, atol=1e-12)
    one, two = np.asarray(core.prior.rate)
    assert one / two == pytest.approx(4.0, rel=0.02)


def test_a_cause_of_few_draws_goes_with_the_likeliest():
    cause = np.repeat([0, 1, 2], [3000, 971, 29])
    np.testing.assert_array_equal(told_apart(cause, 3), np.where(cause == 2, 0, cause))
    np.testing.assert_array_equal(told_apart(cause[:3999], 2), cause[:3999])
    assert len(followed_one_by_one(LINEAR, VARIANCE, cause).weight) == 2


def test_what_is_fixed_tells_of_its_own_cause_only():
    """In one cause the first number follows what is fixed, in the other it does not."""
    fixed = RNG.normal(size=(4000, 1))
    linear = LINEAR + np.where(CAUSE[:, None] == 1, [2.0, 0.0, 0.0], 0.0) * fixed
    chosen = np.array([5, 3500])
    law = laws_given(linear, VARIANCE, fixed, CAUSE, chosen)
    middle = [linear[number == CAUSE].mean(axis=0) for number in (0, 1)]
    assert law.mean[0] == pytest.approx(middle[0], abs=0.15)
    assert law.mean[1, 0] - middle[1][0] == pytest.approx(2.0 * fixed[3500, 0], abs=0.3)
    # Beside it the spread is what it was.
    assert covariance(law, 1)[0, 0] == pytest.approx(9.0, rel=0.15)
    particles = Particles(linear, VARIANCE, fixed, CAUSE, chosen)
    np.testing.assert_allclose(particles.prior.mean[:, 0], law.mean[:, 0])
    assert particles.prior.mean[:, 1].tolist() == [1.0, 1.0]
