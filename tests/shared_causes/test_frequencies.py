"""Frequencies of causes are those of every assignment, written out."""

from itertools import product

import numpy as np
import pytest
from scipy.special import gammaln, logsumexp

from hdcal.inference.diagnostics import have_mixed
from hdcal.shared_causes import frequencies
from hdcal.shared_causes.frequencies import sample_frequencies

COUNTS = np.array([0.6, 0.25, 0.15])
GEARS = 5


def every_assignment(log_likelihood: np.ndarray):
    """Return mean share and chances, over all assignments of causes to gears."""
    gears, causes = log_likelihood.shape
    assigned = np.array(list(product(range(causes), repeat=gears)))
    seen = np.stack([(assigned == k).sum(axis=1) for k in range(causes)], axis=1)
    # Dirichlet's law with the frequencies integrated out.
    prior = np.sum(gammaln(COUNTS + seen), axis=1)
    weight = prior + log_likelihood[np.arange(gears), assigned].sum(axis=1)
    weight = np.exp(weight - logsumexp(weight))
    share = weight @ (COUNTS + seen) / (COUNTS.sum() + gears)
    chance = np.stack([weight @ (assigned == k) for k in range(causes)], axis=1)
    number = weight @ (seen == 2)
    return share, chance, number


def readings(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 2.0, (GEARS, len(COUNTS)))


def lookalikes() -> np.ndarray:
    """Return gears in which two causes are as likely, and none is excluded."""
    found = np.tile([-40.0, 0.0, 0.0], (GEARS, 1))
    found[:, 2] -= 0.1
    return found


@pytest.mark.parametrize("log_likelihood", [readings(0), lookalikes()])
def test_draws_are_those_of_every_assignment(log_likelihood: np.ndarray):
    rng = np.random.default_rng(3)
    found = sample_frequencies(log_likelihood, COUNTS, rng, draws=3000)
    share, chance, two = every_assignment(log_likelihood)
    assert found.share.mean(axis=(0, 1)) == pytest.approx(share, abs=0.02)
    assert found.chance == pytest.approx(chance, abs=0.03)
    number = np.stack([np.sum(found.cause == k, axis=-1) for k in range(3)], axis=-1)
    assert (number == 2).mean(axis=(0, 1)) == pytest.approx(two, abs=0.03)


def test_without_exchanges_lookalikes_are_not_left(monkeypatch: pytest.MonkeyPatch):
    """Plain Gibbs sampling would report that all gears have one of the two."""
    many = np.tile(lookalikes()[0], (30, 1))

    def mixed() -> bool:
        drawn = sample_frequencies(many, COUNTS, np.random.default_rng(0)).share
        return have_mixed({"second": drawn[..., 1]})

    assert mixed()
    monkeypatch.setattr(frequencies, "_EXCHANGES", 0)
    assert not mixed()
