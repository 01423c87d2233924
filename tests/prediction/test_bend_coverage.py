"""Intervals of the mean force hold the truth of rigs whose curves are not straight."""

import numpy as np
import pytest
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.bounds import OF_TIME
from posteriors import regressed
from pulled_further import TIMES, all_pulled_further
from scipy import stats

import hdcal

OF_SHAPE = ("progressive_stiffening", "contact_bedding", "seating_slack", "hysteresis")
# Probability that a fair interval fails the test; the seeds are fixed.
LEVEL = 1e-3


def held(names, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which intervals hold the truth, (rig, place): answered, the line's."""
    rng, answered, alone = np.random.default_rng(seed), [], []
    for case in all_pulled_further(names, count, seed):
        posterior = regressed(case.deformation, case.force, rng)
        found, draws = hdcal.predict(posterior, case.at), posterior.draws
        low, high = found.physics_lo_N, found.physics_hi_N
        answered.append((low <= case.truth) & (case.truth <= high))
        line = np.outer(draws["stiffness"], case.at) + draws["force_offset"][:, None]
        low, high = np.quantile(line, [0.025, 0.975], axis=0)
        alone.append((low <= case.truth) & (case.truth <= high))
    return np.array(answered), np.array(alone)


def shortfall(hits: np.ndarray, share: float) -> float:
    """Return the probability of so few hits at a place, or fewer; the least."""
    return float(stats.binom.cdf(hits.sum(axis=0), len(hits), share).min())


def test_a_slice_of_mechanisms_stays_inside():
    answered, alone = held(OF_SHAPE, 4, seed=11)
    assert len(answered) >= 20
    assert shortfall(answered, 0.92) > LEVEL, answered.mean(axis=0)
    # The same few rigs show that the line alone does not hold, inside and beyond.
    places = [TIMES.index(times) for times in (1.0, 1.02, 1.5, 2.0)]
    for place in places:
        assert shortfall(alone[:, [place]], 0.92) < LEVEL, alone.mean(axis=0)


@pytest.mark.slow
def test_every_mechanism_stays_inside():
    names = [name for name in MECHANISMS if name not in OF_TIME]
    answered, alone = held(names, 30, seed=12)
    print(dict(zip(TIMES, answered.mean(axis=0).round(3).tolist(), strict=True)))
    assert len(answered) >= 200
    assert shortfall(answered, 0.92) > LEVEL, answered.mean(axis=0)
    assert np.all(alone.mean(axis=0)[TIMES.index(1.5) :] < 0.5)
