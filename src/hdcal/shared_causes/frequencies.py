"""Frequencies of causes, and the cause of each gear, from the evidence of each gear.

Every gear has one cause, which may be none. Frequencies and causes are drawn in turn.
Similar causes would change places in all gears at once only after very many draws:
such exchanges are proposed in addition.

Source:
    Diebolt and Robert, Journal of the Royal Statistical Society B 56 (1994), the
    sampler of a mixture's weights.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, softmax

# Sweeps that are left out, and exchanges that are proposed in each sweep.
_WARMUP, _EXCHANGES = 500, 6
# Keeps the logarithm of a frequency finite.
_LEAST = 1e-300


class Frequencies(NamedTuple):
    """Share of each cause among future gears (chain, draw, k); cause of each gear.

    The cause is an index (chain, draw, g); `chance` is the probability of each cause in
    each gear, given all gears (g, k).
    """

    share: np.ndarray
    cause: np.ndarray
    chance: np.ndarray


def sample_frequencies(
    log_likelihood: np.ndarray,
    counts: np.ndarray,
    rng: np.random.Generator,
    *,
    chains: int = 4,
    draws: int = 1500,
) -> Frequencies:
    """Draw frequencies and causes in independent chains.

    The likelihood of each gear by cause has the shape (g, k), the counts of the
    Dirichlet prior, in gears, (k,).
    """
    gears, causes = log_likelihood.shape
    cause = _drawn(np.stack([log_likelihood + np.log(counts)] * chains), rng)
    share = np.empty((chains, draws, causes))
    kept = np.empty((chains, draws, gears), np.int16)
    chance = np.zeros((gears, causes))
    each = np.arange(chains)[:, None]
    for sweep in range(-_WARMUP, draws):
        for chain in cause:
            for _ in range(_EXCHANGES):
                _exchange(chain, log_likelihood, counts, rng)
        members = np.zeros((chains, causes))
        np.add.at(members, (each, cause), 1.0)
        drawn = rng.standard_gamma(counts + members)
        now = drawn / drawn.sum(axis=1, keepdims=True)
        log_joint = np.log(np.maximum(now, _LEAST))[:, None] + log_likelihood
        before, cause = cause, _drawn(log_joint, rng)
        if sweep >= 0:
            share[:, sweep], kept[:, sweep] = now, before
            chance += softmax(log_joint, axis=-1).mean(axis=0)
    return Frequencies(share, kept, chance / draws)


def _drawn(log_weight: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return an index along the last axis, drawn by weight (Gumbel's method)."""
    return np.argmax(log_weight + rng.gumbel(size=log_weight.shape), axis=-1)


def _exchange(
    cause: np.ndarray,
    log_likelihood: np.ndarray,
    counts: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Exchange the gears of two causes, the frequencies integrated out (Metropolis)."""
    one, other = cause[rng.integers(len(cause))], rng.integers(len(counts))
    if one == other:
        return
    of_one, of_other = cause == one, cause == other
    gain = log_likelihood[:, other] - log_likelihood[:, one]
    n, m = of_one.sum(), of_other.sum()
    before = gammaln(counts[one] + n) + gammaln(counts[other] + m)
    after = gammaln(counts[one] + m) + gammaln(counts[other] + n)
    change = gain[of_one].sum() - gain[of_other].sum() + after - before
    if np.log(rng.random()) < change:
        cause[of_one], cause[of_other] = other, one
