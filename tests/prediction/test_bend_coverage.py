"""Intervals of the mean force hold the truth of rigs whose curves are not straight."""

import numpy as np
import pytest
from benchmarks.blind.rig.history import FULL
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.virtual_rig import draw_rig
from benchmarks.bounds import OF_TIME, ramp
from posteriors import regressed
from scipy import stats

import hdcal

OF_SHAPE = ("progressive_stiffening", "contact_bedding", "seating_slack", "hysteresis")
# Probability that a fair interval fails the test; the seeds are fixed.
LEVEL = 1e-3
# Largest tested deformation [mm], and where the truth is known, in multiples of it.
TESTED, TIMES = FULL / 2.0, (0.5, 0.9, 1.0, 1.0001, 1.02, 1.1, 1.2, 1.5, 2.0)
MEASURED, AT = np.linspace(0.02, TESTED, 30), TESTED * np.array(TIMES)
PATH = np.union1d(MEASURED, AT)


def partly_tested(name: str, r: float, rng: np.random.Generator):
    """Return measured forces and true readings at `AT` of a rig, if it can be made.

    Args:
        name: of the mechanism.
        r: RMS of its gap over the noise in the measured rows.
        rng: draws rig, shape and noise.
    """
    rig, tested = draw_rig(ramp(PATH), rng), np.isin(PATH, MEASURED)
    active = rig.draw_mechanism(MECHANISMS[name], r, rng, tested)
    if active is None:
        return None
    full = rig.readings([active])
    force = full[tested] + rig.sigma * rng.normal(size=len(MEASURED))
    return force, full[np.searchsorted(PATH, AT)]


def held(names, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which intervals hold the truth, (rig, place): answered, the line's."""
    rng, answered, alone = np.random.default_rng(seed), [], []
    rigs = [(name, r) for name in names for r in (1.0, 2.0) for _ in range(count)]
    for made in (partly_tested(name, r, rng) for name, r in rigs):
        if made is None:
            continue
        force, truth = made
        posterior = regressed(MEASURED, force, rng)
        found, draws = hdcal.predict(posterior, AT), posterior.draws
        low, high = found.physics_lo_N, found.physics_hi_N
        answered.append((low <= truth) & (truth <= high))
        line = np.outer(draws["stiffness"], AT) + draws["force_offset"][:, None]
        low, high = np.quantile(line, [0.025, 0.975], axis=0)
        alone.append((low <= truth) & (truth <= high))
    return np.array(answered), np.array(alone)


def shortfall(hits: np.ndarray, share: float) -> float:
    """Return the least probability of so few hits at a place, or fewer."""
    return float(stats.binom.cdf(hits.sum(axis=0), len(hits), share).min())


def test_a_slice_of_mechanisms_stays_inside():
    answered, alone = held(OF_SHAPE, 4, seed=11)
    assert len(answered) >= 20
    assert shortfall(answered, 0.92) > LEVEL, answered.mean(axis=0)
    # The same few rigs show that the line alone does not hold, inside and beyond.
    for times in (1.0, 1.02, 1.5, 2.0):
        hits = alone[:, [TIMES.index(times)]]
        assert shortfall(hits, 0.92) < LEVEL, alone.mean(axis=0)


@pytest.mark.slow
def test_every_mechanism_stays_inside():
    names = [name for name in MECHANISMS if name not in OF_TIME]
    answered, alone = held(names, 30, seed=12)
    print(dict(zip(TIMES, answered.mean(axis=0).round(3).tolist(), strict=True)))
    assert len(answered) >= 200
    assert shortfall(answered, 0.92) > LEVEL, answered.mean(axis=0)
    assert np.all(alone.mean(axis=0)[TIMES.index(1.5) :] < 0.5)
