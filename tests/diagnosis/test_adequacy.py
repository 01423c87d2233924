"""What resembles a cause and is none is not called one."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from diagnosis_cases import NOISE, judged, rich, simulated
from rigs import make_case
from slices import slice_of

from hdcal.diagnosis import which as which_effect
from hdcal.diagnosis.adequacy import chance_of_so_few_runs
from hdcal.diagnosis.naming import Naming, Tally
from hdcal.evidence.bursts import log_sign_odds
from hdcal.evidence.quantisation import rounding_step


def changed(change, seed: int = 3):
    """Return the verdict on a rig without effects, its force changed by this [N]."""
    records = simulated(rich(), seed=seed).records
    return judged(make_case(replace(records, force=records.force + change(records))))


@pytest.mark.thorough
def test_a_crack_is_not_fatigue():
    """The stiffness falls at once in one cycle, not with the logarithm of them all."""

    def crack(records):
        late = np.arange(len(records.force)) >= 100
        return np.where(late, -0.03 * 195.0 * records.deformation, 0.0)

    which = changed(crack).which
    assert which.verdict == "unknown"
    assert which.inclusion["stiffness_fatigue"] < 0.5


@pytest.mark.thorough
def test_fatigue_is_believed():
    case = simulated(rich(), {"stiffness_fatigue": {"loss": 0.03}}, seed=4)
    which = judged(case).which
    assert which.effect == "stiffness_fatigue"
    assert which.inclusion["stiffness_fatigue"] > 0.8


def struck(rows, signs):
    def change(records):
        error = np.zeros(len(records.force))
        error[rows] = 9.0 * NOISE * np.asarray(signs)
        return error

    return change


@pytest.mark.thorough
def test_a_burst_is_not_outliers():
    """Twelve readings one after the other, all too high, have one cause."""
    which = changed(struck(np.arange(65, 77), np.ones(12))).which
    assert which.verdict not in ("named", "group")
    scattered = np.arange(8, 180, 15)
    signs = np.resize([1.0, -1.0, -1.0], len(scattered))
    assert changed(struck(scattered, signs)).which.effect == "outliers"


@pytest.mark.thorough
def test_wild_readings_in_one_place_are_not_outliers():
    """Up and down, as of blocks in another order: no sign lasts, but the place does."""
    signs = np.resize([1.0, 1.0, -1.0, -1.0, 1.0, -1.0], 12)
    which = changed(struck(np.arange(65, 77), signs)).which
    assert which.verdict not in ("named", "group") and which.doubted


def test_places_of_wild_readings_are_counted():
    """All places of four among nine, against the law of the number of runs."""
    every = []
    for places in combinations(range(9), 4):
        wild = np.zeros(9, bool)
        wild[list(places)] = True
        every.append(wild)
    parts = [np.split(w, np.flatnonzero(w[1:] != w[:-1]) + 1) for w in every]
    runs = np.array([sum(bool(part[0]) for part in each) for each in parts])
    for wild, count in zip(every, runs, strict=True):
        chance = chance_of_so_few_runs(wild)
        assert chance == pytest.approx(np.mean(runs <= count))
    assert chance_of_so_few_runs(np.zeros(9, bool)) == 1.0


def test_friction_is_named_beside_readings_that_are_very_wild(monkeypatch):
    """Without the loop they are less far off, and beside it farther than expected."""
    # Whether outliers may be named is another question.
    monkeypatch.setattr(
        which_effect, "naming", lambda: Naming({}, Tally(1, 0), Tally(1, 0))
    )
    case = simulated(rich(), {"coulomb_friction": {"force": 3.0}}, seed=5)
    force = np.array(case.records.force)
    force[[50, 131]] += 40.0 * NOISE
    which = judged(make_case(replace(case.records, force=force))).which
    assert which.verdict == "named" and not which.doubted
    assert (which.effect, which.second_effect) == ("coulomb_friction", "outliers")


@pytest.mark.parametrize("period", slice_of([2.7, 6.0], [6.0]))
def test_a_hum_is_something_unknown(period):
    """No covariate shows it, only the order of the rows does."""

    def hum(records):
        turns = 2.0 * np.pi * np.arange(len(records.force)) / period
        return 2.5 * NOISE * np.sin(turns)

    verdict = changed(hum)
    assert verdict.gap.detected
    assert verdict.which.verdict == "unknown"


def test_counts_are_found_through_few_digits():
    """A converter's step is no round number, and readings are written with four."""
    rng = np.random.default_rng(2)
    true = 0.83721
    readings = np.round(0.3127 + true * rng.integers(0, 120, 200), 4)
    step, _ = rounding_step(readings, 0.5)
    assert step == pytest.approx(true, rel=1e-5)
    assert rounding_step(np.round(rng.normal(50.0, 20.0, 200), 4), 0.5)[0] == 0.0


def test_odds_of_signs_are_an_integral():
    """∫ sᵃ (1 − s)ᵇ 2 ds from ½ to 1, over ½ᵃ⁺ᵇ."""
    s = np.linspace(0.5, 1.0, 20001)
    for same, pairs in ((0, 0), (8, 8), (5, 9), (0, 6)):
        slow = np.trapezoid(2.0 * s**same * (1.0 - s) ** (pairs - same), s) * 2.0**pairs
        assert np.exp(log_sign_odds(same, pairs)) == pytest.approx(slow, rel=1e-6)
    assert log_sign_odds(8, 8) > np.log(10.0) > 0.0 > log_sign_odds(3, 8)
    # Thousands of rows are no reason to overflow.
    assert np.isfinite([log_sign_odds(n, 5000) for n in (0, 2500, 5000)]).all()
