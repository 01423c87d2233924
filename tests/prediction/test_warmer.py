"""Beyond the tested temperatures the rig drifts, and the answer knows it."""

import numpy as np
import pytest
from posteriors import regressed

import hdcal

QUICK = {"sensitivities": False}
# What the shipped priors say of a rig.
ZERO_SD, FRAME_SD, ALPHA, ALPHA_SD = 0.1, 1e-3, 3e-4, 4e-5


def held(count: int, seed: int) -> tuple[float, float, float]:
    """Return in which share of rigs the truth at 80 °C is inside, measured at 20 °C.

    Of the mean reading, of one more reading, and of the mean with the loss of modulus
    alone, which was the answer before.
    """
    rng, right = np.random.default_rng(seed), np.zeros(3)
    x = np.linspace(0.02, 0.54, 30)
    for _ in range(count):
        stiffness, zero = rng.uniform(150.0, 260.0), rng.normal()
        force = stiffness * x + zero + rng.normal(0.0, 0.5, 30)
        posterior = regressed(x, force, rng)
        warm = stiffness * (1.0 - rng.normal(ALPHA, ALPHA_SD) * 60.0)
        at = 0.4 + rng.normal(0.0, FRAME_SD) * 60.0
        truth = warm * at + zero + rng.normal(0.0, ZERO_SD) * 60.0
        level = hdcal.margin(posterior, 0.4, temperature=80.0, **QUICK).worst
        bands = hdcal.predict(posterior, [0.4], [80.0])
        new = truth + rng.normal(0.0, 0.5)
        draws = posterior.draws
        modulus = draws["stiffness"] * (1.0 - draws["alpha"] * 60.0)
        low, high = np.quantile(modulus * 0.4 + draws["force_offset"], [0.025, 0.975])
        right += [
            level.force_N.lo <= truth <= level.force_N.hi,
            bands.new_measurement_lo_N[0] <= new <= bands.new_measurement_hi_N[0],
            low <= truth <= high,
        ]
    return tuple(right / count)


def test_a_slice_of_rigs_stays_inside():
    mean, new, without = held(24, seed=4)
    assert mean >= 0.85 and new >= 0.85, (mean, new)
    assert without <= 0.3, without


@pytest.mark.slow
def test_two_hundred_rigs_stay_inside():
    mean, new, _ = held(200, seed=5)
    assert 0.92 <= mean <= 0.98 and 0.92 <= new <= 0.98, (mean, new)


def test_only_the_rig_drifts_and_only_outside():
    x, rng = np.linspace(0.02, 0.54, 30), np.random.default_rng(1)
    posterior = regressed(x, 200.0 * x + rng.normal(0.0, 0.5, 30), rng)
    # The gear knows nothing of the rig that it was tested on.
    load = {"temperature": 80.0, "quantity": "load", **QUICK}
    found = hdcal.margin(posterior, 0.4, **load)
    cold = hdcal.margin(posterior, 0.4, quantity="load", **QUICK)
    widths = [one.worst.force_N.hi - one.worst.force_N.lo for one in (found, cold)]
    assert widths[0] < 1.5 * widths[1]
    # Within what was tested nothing drifts.
    assert hdcal.margin(posterior, 0.4, **QUICK).extrapolated == ()
