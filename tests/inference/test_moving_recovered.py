"""Mass, damping and stiffness are found again, and a wrong model is told by counting."""

import numpy as np
import pytest
from moving import TRUTH, motion, moving_case, moving_gear

from hdcal import Prior, calibrate_dynamic

SETTINGS = {"chains": 4, "warmup": 400, "draws": 500}
SOUGHT = ("mass", "damping", "stiffness")


def certain(value: float) -> Prior:
    """Return a prior that lets no data speak: fixed, but of a sampled family."""
    return Prior("lognormal", (value, 1e-3))


def covered(seeds, **priors) -> dict[str, int]:
    """Return in how many seeds each truth lies inside its 95 % interval."""
    count = dict.fromkeys(SOUGHT, 0)
    for seed in seeds:
        case = moving_case(seed, moving_gear(**priors))
        draws = calibrate_dynamic(case, **SETTINGS).draws
        for name, truth in zip(SOUGHT, motion(TRUTH, case), strict=True):
            low, high = np.quantile(draws[name], [0.025, 0.975])
            count[name] += int(low <= truth <= high)
    return count


def test_a_few_seeds_are_recovered():
    found = covered(range(6))
    # All but one: with 95 % intervals fewer come once in 30 parameters.
    assert min(found.values()) >= 5, found


def test_noise_taken_too_small_is_told_by_the_same_count():
    found = covered(
        range(6), deformation_sigma=certain(0.3 * TRUTH["deformation_sigma"])
    )
    assert min(found.values()) < 5, found


def test_a_mass_taken_too_large_is_told_by_the_same_count():
    found = covered(range(2), mass=certain(1.2 * TRUTH["mass"]))
    assert found["mass"] == found["stiffness"] == 0, found


@pytest.mark.slow
def test_fifty_seeds_are_recovered():
    found = covered(range(50))
    assert min(found.values()) >= 45, found
