"""Intervals, calibration errors and detection limits agree with closed forms."""

import math

import numpy as np
import pytest
from handmade import row, said, scored, truth
from scipy.stats import norm

from hdcal.blind.scoring.detection import ALARM, fit
from hdcal.blind.scoring.estimates import mean, median, share
from hdcal.blind.scoring.reliability import bin_of, errors

# Numbers with intervals


def test_wilson_is_that_of_the_literature():
    # Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263 and 0 of 20.
    found = share([1] * 81 + [0] * 182)
    assert (found.lo, found.hi) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    found = share([0] * 20)
    assert (found.lo, found.hi) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert share([1] * 20).hi == 1.0


def test_a_bootstrap_interval_of_a_mean_is_nearly_the_normal_one():
    values = np.random.default_rng(0).normal(size=400).tolist()
    found = mean(values)
    half = 1.96 * np.std(values) / 20.0
    assert found.value == pytest.approx(np.mean(values))
    assert found.hi - found.lo == pytest.approx(2 * half, rel=0.1)


def test_medians_and_means_of_little():
    assert median([3.0, 1.0, 2.0]).value == 2.0
    assert (median([]).value, median([]).n) == (None, 0)
    assert (mean([7.0]).value, mean([7.0]).lo) == (7.0, None)


# Calibration


def test_the_calibration_error_by_hand():
    # Two bins: 0.1 said and 1 of 4 true, 0.8 said and 4 of 4 true.
    stated = np.array([0.1] * 4 + [0.8] * 4)
    true = np.array([1, 0, 0, 0, 1, 1, 1, 1])
    plug_in, debiased = errors(stated > 0.5, stated, true, np.ones(8))
    assert plug_in == pytest.approx(0.5 * 0.15 + 0.5 * 0.2)
    again = 0.0
    for gap, p in ((0.15, 0.1), (0.2, 0.8)):
        sd = math.sqrt(p * (1 - p) / 4)
        x = norm.expect(lambda z, m=gap, s=sd: abs(m + s * z))
        again += 0.5 * x
    assert debiased == pytest.approx(max(0.0, 2 * plug_in - again), abs=1e-6)


def test_weights_are_repeats():
    rng = np.random.default_rng(0)
    stated, true = rng.random(40), rng.random(40) < 0.5
    places, weight = bin_of(stated), rng.integers(0, 4, 40)
    repeated = [np.repeat(v, weight) for v in (places, stated, true)]
    slow = errors(*repeated, np.ones(weight.sum()))
    assert errors(places, stated, true, weight) == pytest.approx(slow)


def test_bins_hold_equal_counts_and_never_part_equal_values():
    assert np.bincount(bin_of(np.linspace(0, 1, 200))).tolist() == [20] * 10
    assert set(bin_of(np.ones(200))) == {0}
    assert set(bin_of(np.linspace(0, 1, 39))) == {0}
    assert len(bin_of(np.zeros(0))) == 0


def test_the_debiased_error_of_calibrated_statements_is_small_and_of_others_is_not():
    rng = np.random.default_rng(5)
    found = []
    for _ in range(200):
        p = rng.beta(2.0, 1.0, 400)
        places, one = bin_of(p), np.ones(400)
        honest = errors(places, p, rng.random(400) < p, one)
        low = errors(places, p, rng.random(400) < p - 0.1 * (p > 0.1), one)
        found.append((*honest, low[1]))
    plug_in, debiased, wrong = np.mean(found, axis=0)
    # Twice the mean of |Z| less that of √2 |Z|.
    assert debiased == pytest.approx((2 - 2**0.5) * plug_in, rel=0.1)
    assert wrong == pytest.approx(0.1, abs=0.015)


def test_calibration_is_taken_over_the_chosen_cases():
    labels = [truth(str(i)) for i in range(60)]
    answers = [said(str(i), effect="slack" if i < 30 else "drift") for i in range(60)]
    good = scored(labels, answers, calibration_cases={str(i) for i in range(30)})
    assert row(good, "calibration_top").value == 0.0
    assert row(good, "calibration_top").n == 30
    assert row(scored(labels, answers), "calibration_top").value == pytest.approx(0.5)


def test_the_reliability_table_by_hand():
    chances = {"slack": 0.75, "drift": 0.25}
    names = ["slack", "slack", "drift", "slack"]
    labels = [truth(str(i), names=(name,)) for i, name in enumerate(names)]
    answers = [said(label.case, chances=chances) for label in labels]
    found = scored(labels, answers).reliability
    (own,) = found.top.bins
    assert (own.stated, own.true, own.n) == (0.75, 0.75, 4)
    assert found.top.floor.hi >= found.top.floor.mean > 0.0
    assert found.effects.statements == 8
    assert [line.effect for line in found.classwise] == ["drift", "slack"]


# Detection limits


def test_the_detection_limit_comes_back():
    rng = np.random.default_rng(1)
    r = np.exp(rng.uniform(np.log(0.05), np.log(2.0), 3000))
    middle, slope = math.log(0.3), 4.0
    chance = ALARM + (1 - ALARM) / (1 + np.exp(-slope * (np.log(r) - middle)))
    found = fit("x", r, (rng.random(3000) < chance).astype(float))
    true = math.exp(middle + math.log((0.9 - ALARM) / 0.1) / slope)
    assert found.lo < true < found.hi
    assert found.r90 == pytest.approx(true, rel=0.06)
    assert (np.diff(found.curve.fraction) >= 0.0).all()


def test_a_limit_that_is_not_reached_is_null_and_one_below_all_is_said_to_be():
    r = np.array([0.1, 0.2, 0.5] * 10)
    never = fit("x", r, np.zeros(30))
    assert (never.r90, never.hi, never.reached) == (None, None, False)
    always = fit("x", np.array([1.0, 2.0, 5.0] * 30), np.ones(90))
    assert always.r90 == pytest.approx(1.0)
    assert always.below_all and always.reached
