"""Probabilities of exceedance against exact laws, and what draws do not resolve."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import single, written_posterior
from scipy import stats
from test_budget import exact

import hdcal
from hdcal.prediction.conditions import RAREST


def middle(posterior, at: float = 0.1) -> float:
    return hdcal.margin(posterior, at).estimate_N


@pytest.fixture(scope="module")
def normal():
    return exact(4000)


@pytest.mark.parametrize("chance", [0.3, 1e-3, 1e-5])
def test_a_normal_tail_is_exact(normal, chance: float):
    limit = middle(normal) + 1.5 * stats.norm.isf(chance)
    risk = hdcal.margin(normal, 0.1, limit_force=limit).worst.exceedance
    assert risk.resolved
    # The bend inside the range is a few hundredths of the noise.
    assert risk.probability == pytest.approx(chance, rel=0.1)
    assert risk.beta == pytest.approx(-stats.norm.ppf(risk.probability))
    assert risk.error < 0.02 * risk.probability
    assert risk.lo <= risk.probability <= risk.hi


def student(count: int, dof: float):
    """Return one gear whose noise is known from `dof` degrees of freedom."""
    known = exact(count)
    levels = (np.random.default_rng(2).permutation(count) + 0.5) / count
    sigma = 1.5 * np.sqrt(dof / stats.chi2.ppf(levels, dof))
    return written_posterior(known.case, {**known.draws, "sigma": sigma})


@pytest.mark.parametrize("chance", [1e-1, 1e-3, 1e-5])
def test_a_student_tail_is_exact_or_an_upper_limit(chance: float):
    posterior, dof = student(4000, 6.0), 6.0
    limit = middle(posterior) + 1.5 * stats.t.isf(chance, dof)
    risk = hdcal.margin(posterior, 0.1, limit_force=limit).worst.exceedance
    if risk.resolved:
        assert risk.error <= 0.3 * risk.probability
        assert abs(risk.probability - chance) < max(3.0 * risk.error, 0.05 * chance)
    else:
        assert chance <= 1e-4
        assert chance < risk.probability < 0.05
    assert (chance >= 1e-3) <= risk.resolved
    assert risk.beta == pytest.approx(-stats.norm.ppf(risk.probability))


def test_draws_that_depend_on_each_other_have_a_larger_error():
    """The fewer effective draws the larger the error, in proportion to its root."""
    posterior = student(4000, 6.0)
    limit = middle(posterior) + 1.5 * stats.t.isf(1e-2, 6.0)
    errors = []
    for size in (4000.0, 1000.0, 250.0):
        sizes = {
            name: replace(each, ess_tail=size)
            for name, each in posterior.diagnoses.items()
        }
        less = replace(posterior, diagnoses=sizes)
        errors.append(hdcal.margin(less, 0.1, limit_force=limit).worst.exceedance.error)
    assert errors[1] == pytest.approx(2.0 * errors[0])
    assert errors[2] == pytest.approx(4.0 * errors[0])


def test_what_the_draws_do_not_resolve_is_an_upper_limit(normal):
    """Far out, and of a load, which has no scatter within a draw."""
    for sds in (5.5, 40.0):
        limit = middle(normal) + 1.5 * sds
        risk = hdcal.margin(normal, 0.1, limit_force=limit).worst.exceedance
        assert not risk.resolved and risk.probability >= RAREST
        assert np.isfinite(risk.beta)
    asked = {"quantity": "load", "limit_force": 200.0}
    risk = hdcal.margin(single(), 0.4, **asked).worst.exceedance
    assert not risk.resolved and risk.probability >= 3.0 / 2000
    risk = hdcal.margin(single(size=400), 0.4, limit_force=20.0).worst.exceedance
    assert risk.resolved and risk.probability == pytest.approx(1.0)
    assert risk.lo == risk.at_confidence == 1.0 and np.isfinite(risk.beta)


def test_the_stated_error_is_the_scatter_over_posteriors():
    """Independent draws of σ: the probability scatters as its error says."""
    found, size, dof = [], 400, 6.0
    known = exact(size)
    for seed in range(24):
        chi = np.random.default_rng(seed).chisquare(dof, size)
        sigma = {"sigma": 1.5 * np.sqrt(dof / chi)}
        posterior = written_posterior(known.case, {**known.draws, **sigma})
        limit = 20.0 + 1.5 * stats.t.isf(0.01, dof)
        found.append(hdcal.margin(posterior, 0.1, limit_force=limit).worst.exceedance)
    chances = [risk.probability for risk in found]
    expected = np.std(chances, ddof=1)
    assert np.mean([risk.error for risk in found]) == pytest.approx(expected, rel=0.35)
