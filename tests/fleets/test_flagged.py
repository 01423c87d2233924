"""Odd gears are flagged in what they are odd in, and ordinary ones are not."""

import numpy as np
import pytest
from gear_rows import ordinary
from scipy.stats import binomtest

from hdcal.fleets.gear_table import QUANTITIES
from hdcal.fleets.model.population import FittedFleet, Sampling, fit_population


def fitted(gears: int, seed: int, **odd: float) -> FittedFleet:
    """Return a fleet whose first gear is odd by a number of scatters."""
    rng = np.random.default_rng(seed)
    rows = ordinary(gears, rng)
    rows.stiffness[0] *= 1.0 + 0.02 * odd.get("stiffness", 0.0)
    rows.zero[0] += 0.8 * odd.get("zero", 0.0)
    rows.noise[0] *= np.exp(0.1 * odd.get("noise", 0.0))
    rows.loop[0] += 0.1 * odd.get("loop", 0.0)
    rows.bend[0] += 0.1 * odd.get("bend", 0.0)
    return fit_population(rows.readings(rng), Sampling(seed=seed))


def flagged(found: FittedFleet) -> dict[str, list[int]]:
    return {name: np.flatnonzero(found.flagged(name)).tolist() for name in QUANTITIES}


@pytest.mark.parametrize(
    ("quantity", "size"),
    [
        ("stiffness", 8.0),
        ("zero", 10.0),
        ("noise", 15.0),
        ("loop", 25.0),
        ("bend", -25.0),
    ],
)
def test_an_odd_gear_is_flagged_in_its_quantity_alone(quantity: str, size: float):
    found = fitted(12, 3, **{quantity: size})
    expected = {name: [] for name in QUANTITIES} | {quantity: [0]}
    assert flagged(found) == expected
    assert not [one for one in found.checks if one.outcome == "failed"]


def test_a_gear_far_off_changes_no_other_gear():
    """A broken specimen, a tenth as stiff, with thirty times the noise."""
    plain, broken = fitted(12, 5), fitted(12, 5, stiffness=-45.0, noise=34.0)
    assert not [one for one in broken.checks if one.outcome == "failed"]
    both = [found.gears["stiffness"].to_numpy()[1:] for found in (plain, broken)]
    width = (plain.gears["stiffness_hi"] - plain.gears["stiffness_lo"]).to_numpy()[1:]
    assert np.max(np.abs(both[1] - both[0]) / width) < 0.1
    spread = [np.median(found.draws["specimen_sd"]) for found in (plain, broken)]
    assert spread[1] == pytest.approx(spread[0], rel=0.4)


@pytest.mark.slow
@pytest.mark.parametrize("gears", [5, 10, 30, 300])
def test_ordinary_fleets_are_seldom_flagged(gears: int):
    """At most one fleet of twenty has a false flag, whatever the quantity."""
    fleets = 200
    false = sum(any(flagged(fitted(gears, seed)).values()) for seed in range(fleets))
    assert binomtest(false, fleets, 0.05, alternative="greater").pvalue > 0.01


@pytest.mark.slow
def test_a_gear_of_thirty_is_found_as_often_as_can_be():
    """At four scatters, half an error each way, Grubbs' test finds four of five."""
    found = [
        flagged(fitted(30, seed, stiffness=4.0))["stiffness"] for seed in range(100)
    ]
    assert np.mean([0 in one for one in found]) > 0.6
