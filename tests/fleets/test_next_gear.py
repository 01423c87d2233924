"""Future gears, against gears that are drawn one by one."""

import numpy as np
import pytest

from hdcal.fleets.next_gear import next_force, next_gear, stiffness_of_gears

DRAWS = {
    "stiffness": 200.0,
    "zero": 0.7,
    "specimen_sd": 0.02,
    "run_offset_sd": 0.6,
    "sigma": 0.5,
    "noise_spread": 0.0,
    "off_share": 0.1,
    "off_ratio": 5.0,
    "zero_off_share": 0.05,
    "zero_off_ratio": 6.0,
    "lot_sd": 0.01,
    "operator_sd": 0.4,
    "rig_sd": 0.015,
    **{f"{kind}_{k}": 0.0 for kind in ("lot", "operator", "rig") for k in (1, 2)},
    "lot_ratio": 0.5,
}
COUNT = 400_000
# A lot, an operator and a rig lie about the mean of those measured, which are two each.
NEW = np.sqrt(1.5)


def draws(**more):
    return {name: np.full(4000, value) for name, value in {**DRAWS, **more}.items()}


def drawn_one_by_one() -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness of gears [N/mm], and their force at 0.4 mm [N]."""
    rng = np.random.default_rng(5)
    normal = rng.standard_normal((6, COUNT))
    odd, odd_zero = rng.random((2, COUNT)) < np.array([[0.1], [0.05]])
    own = 0.02 * np.where(odd, np.sqrt(26.0), 1.0) * normal[0]
    stiffness = 200.0 * (1.0 + own + 0.01 * NEW * normal[1])
    zero = 0.7 + 0.6 * np.where(odd_zero, np.sqrt(37.0), 1.0) * normal[2]
    zero += 0.4 * NEW * normal[3]
    gain = 1.0 + 0.015 * NEW * normal[5]
    return stiffness, stiffness * gain * 0.4 + zero + 0.5 * normal[4]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_forces_are_those_of_gears_drawn_one_by_one(sense):
    """The bounds of a known population are its quantiles."""
    forces = drawn_one_by_one()[1]
    # A gear that is pulled needs the same size if its zero has the other sign too.
    asked = draws(zero=0.7 * sense), 0.4 * sense, 84.0
    found = next_force(*asked, tested=0.5)
    for bound in found.bounds:
        ends = np.quantile(forces, [1.0 - bound.content, bound.content])
        assert [bound.at_least, bound.at_most] == pytest.approx(ends, abs=0.15)
    assert found.probability_exceeded is not None
    share = np.mean(forces > 84.0)
    assert found.probability_exceeded.median == pytest.approx(share, abs=0.002)
    ends = np.quantile(forces, [0.025, 0.975])
    assert [found.force_N.lo, found.force_N.hi] == pytest.approx(ends, abs=1.0)
    assert not found.beyond_tested
    assert next_force(asked[0], 0.6 * sense, tested=0.5).beyond_tested


def test_stiffnesses_are_those_of_gears_drawn_one_by_one():
    stiffness = drawn_one_by_one()[0]
    found = next_gear(draws(), 0)
    for one in found.bounds:
        ends = np.quantile(stiffness, [1.0 - one.content, one.content])
        bounds = [one.at_least, one.at_most]
        assert bounds == pytest.approx(ends, rel=2e-3)
    ends = np.quantile(stiffness, [0.025, 0.975])
    interval = found.stiffness_N_per_mm
    assert [interval.lo, interval.hi] == pytest.approx(ends, rel=0.015)
    sample = stiffness_of_gears(draws(off_share=0.0, lot_sd=0.0)).sample(1)
    assert np.std(sample) == pytest.approx(4.0, rel=0.05)


def test_each_bound_has_its_confidence():
    """In a share of the populations at least so many gears are on its side."""
    rng = np.random.default_rng(3)
    population = draws() | {
        "stiffness": rng.normal(200.0, 2.0, 4000),
        "specimen_sd": rng.uniform(0.01, 0.03, 4000),
    }
    gears = stiffness_of_gears(population)
    bounds = gears.bounds(0.9)
    low, high = bounds.at_least, bounds.at_most
    assert np.mean(gears.above(low) >= 0.9) == pytest.approx(0.95, abs=1e-3)
    assert np.mean(1.0 - gears.above(high) >= 0.9) == pytest.approx(0.95, abs=1e-3)


def test_an_uncertain_population_widens_the_bounds():
    known = next_force(draws(), 0.4, tested=0.5)
    spread = np.random.default_rng(1).normal(200.0, 4.0, 4000)
    wide = next_force({**draws(), "stiffness": spread}, 0.4, tested=0.3)
    assert wide.bounds[1].at_most > known.bounds[1].at_most + 1.0
    assert wide.bounds[1].at_least < known.bounds[1].at_least - 1.0
    assert known.probability_exceeded is None
