"""The force of gears to come, against gears that are drawn one by one."""

from dataclasses import replace

import numpy as np
import pytest
from fleets import handmade

import hdcal
from hdcal.fleets.next_force import next_force

DRAWS = {
    "stiffness": 200.0,
    "zero": 0.7,
    "specimen_sd": 0.02,
    "run_offset_sd": 0.6,
    "sigma": 0.5,
    "noise_spread": 0.0,
    "off_share": 0.1,
    "off_ratio": 5.0,
    "lot_sd": 0.01,
    "operator_sd": 0.4,
    "rig_sd": 0.015,
    **{f"{kind}_{k}": 0.0 for kind in ("lot", "operator", "rig") for k in (1, 2)},
    "lot_ratio": 0.5,
}


def draws(**more):
    return {name: np.full(4000, value) for name, value in {**DRAWS, **more}.items()}


def gears_to_come(count=400_000):
    """Return the force of each at 0.4 mm, drawn as the model says it comes about."""
    rng = np.random.default_rng(5)
    normal = rng.standard_normal((6, count))
    odd = rng.random(count) < DRAWS["off_share"]
    # A lot, an operator and a rig, from the mean of those measured, which are two each.
    own = 0.02 * np.where(odd, np.sqrt(26.0), 1.0) * normal[0]
    stiffness = 200.0 * (1.0 + own + 0.01 * np.sqrt(1.5) * normal[1])
    zero = 0.7 + 0.6 * normal[2] + 0.4 * np.sqrt(1.5) * normal[3]
    gain = 1.0 + 0.015 * np.sqrt(1.5) * normal[5]
    return stiffness * gain * 0.4 + zero + 0.5 * normal[4]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_bounds_and_shares_are_those_of_gears_drawn_one_by_one(sense):
    """Draws that are all alike know the population: bounds are its quantiles."""
    forces = gears_to_come()
    # A gear that is pulled reads the same sizes where the zero is turned too.
    found = next_force(draws(zero=0.7 * sense), 0.4 * sense, 84.0)
    for bound in found.bounds:
        ends = np.quantile(forces, [1.0 - bound.content, bound.content])
        assert [bound.at_least_N, bound.at_most_N] == pytest.approx(ends, abs=0.15)
    assert found.probability_exceeded is not None
    share = np.mean(forces > 84.0)
    assert found.probability_exceeded.median == pytest.approx(share, abs=0.002)
    ends = np.quantile(forces, [0.025, 0.975])
    assert [found.force_N.lo, found.force_N.hi] == pytest.approx(ends, abs=1.0)


def test_what_is_not_known_of_the_population_widens_the_bounds():
    sure = next_force(draws(), 0.4)
    spread = np.random.default_rng(1).normal(200.0, 4.0, 4000)
    wide = next_force({**draws(), "stiffness": spread}, 0.4)
    assert wide.bounds[1].at_most_N > sure.bounds[1].at_most_N + 1.0
    assert wide.bounds[1].at_least_N < sure.bounds[1].at_least_N - 1.0
    assert sure.probability_exceeded is None


def test_no_force_is_told_of_a_fleet_that_failed_or_at_no_place():
    fleet = handmade()
    with pytest.raises(hdcal.InputError, match="deformation"):
        fleet.next_force(float("nan"))
    with pytest.raises(hdcal.InputError, match="limit_force"):
        fleet.next_force(0.4, -1.0)
    check = replace(fleet.checks[0], outcome="failed", words="no chain agrees")
    with pytest.raises(hdcal.NotUsable, match="no chain agrees"):
        replace(fleet, checks=(check,)).next_force(0.4)
