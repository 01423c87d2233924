"""The spring is the softest that keeps the window, and its probabilities are true."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from designs import bent, known
from mirrored import mirrored
from posteriors import batch
from schema_checks import obeys
from scipy.optimize import brentq
from scipy.stats import norm

from hdcal.design.gears import calibrated_gears
from hdcal.design.wave_generator import (
    SpringGap,
    WaveGenerator,
    best_common,
    judge,
    set_points,
    wave_generator,
)
from hdcal.errors import InputError
from hdcal.report.charts.chart_spec import Band, Span

WINDOW = (0.38, 0.42)


def straight(stiffness) -> SpringGap:
    """Return straight gears that have to stay in the window."""
    ends = (end * stiffness[None] for end in WINDOW)
    return SpringGap(*WINDOW, *ends, np.zeros(len(stiffness)))


def test_counting_intervals_is_solving_the_balance():
    gears = calibrated_gears(bent(10)).next_ones({"wall_thickness_mm": 0.02}, 0, 1)
    factor, levels = gears.factor({}).reshape(-1, 1), np.array([-20.0, 80.0])
    ends = (gears.forces(np.full(2, end), levels, factor) for end in WINDOW)
    rate, x = 500.0, 0.56
    low, high = set_points(rate, SpringGap(*WINDOW, *ends, np.zeros(10)))
    for draw in range(10):

        def left(at, level, draw=draw):
            force = gears.forces([at], [level], factor)
            return rate * (x - at) - force[0, draw]

        rests = [brentq(left, 1e-3, x, args=(level,), xtol=1e-10) for level in levels]
        inside = WINDOW[0] <= min(rests) and max(rests) <= WINDOW[1]
        assert inside == (low[draw] <= x <= high[draw])


def test_the_best_common_point_lies_in_most_intervals():
    random = np.random.default_rng(0)
    for _ in range(50):
        low = random.normal(size=30)
        high = low + random.normal(0.5, 1.0, size=30)

        def count(x, low=low, high=high):
            return np.count_nonzero((low <= x) & (x <= high))

        # The best count is met at one of the intervals' starts.
        assert count(best_common(low, high)) == max(map(count, low))
    assert best_common(np.array([0.0, 1.0]), np.array([3.0, 5.0])) == 2.0
    assert np.isfinite(best_common(np.array([1.0]), np.array([0.0])))


@pytest.mark.parametrize("rate", [0.01, 20.0, 200.0, 1e5])
def test_the_probability_is_that_of_normal_gears(rate):
    """Straight gears of stiffness N(200, 10): inside when s lies between two lines."""
    draws, gears = 200_000, norm(200.0, 10.0)
    spring = judge(rate, straight(gears.rvs(draws, random_state=0)))
    # ω ≥ lo ⇔ s ≤ c (x − lo)/lo, ω ≤ hi ⇔ s ≥ c (x − hi)/hi.
    x = spring.interference_mm
    most, least = (rate * (x - end) / end for end in WINDOW)
    true = gears.cdf(most) - gears.cdf(least)
    error = np.sqrt(true * (1.0 - true) / draws)
    assert spring.probability == pytest.approx(true, abs=4.0 * error + 1e-12)
    assert spring.zero_backlash == pytest.approx(gears.cdf(most), abs=4e-3)
    others = x + np.linspace(-0.2, 0.2, 401) * (0.04 + 20.0 / rate)
    ends = (gears.cdf(rate * (others / end - 1.0)) for end in WINDOW)
    assert np.max(next(ends) - next(ends)) <= true + 3e-3
    if rate == 0.01:  # force control: one force for all gears
        assert true == pytest.approx(0.682, abs=0.01)
    if rate == 1e5:  # displacement control
        assert spring.probability == 1.0


def test_the_softest_spring_that_meets_the_requirement():
    found = wave_generator(known(), WINDOW, temperatures=[-20.0, 80.0])
    assert found.asked.temperature_C == (-20.0, 20.0, 80.0)
    assert found.spring.probability >= 0.99 and found.spring in found.springs
    rates, shares = found.to_frame()[["rate_N_per_mm", "probability"]].to_numpy().T
    assert np.all(np.diff(rates) > 0.0)
    assert np.all(shares[rates < found.spring.rate_N_per_mm] < 0.99)
    assert min(rates[rates > found.spring.rate_N_per_mm * 1.02]) > 0.0
    # With an exact set point a stiffer spring is never worse.
    assert np.all(np.diff(shares) > -1e-9)
    expected = np.median(calibrated_gears(known()).forces([0.4], [20.0]))
    assert found.force_N[1].median == pytest.approx(expected)
    obeys(found.to_dict(), WaveGenerator)


def test_with_an_error_of_the_set_point_there_is_a_best_rate():
    found = wave_generator(known(), WINDOW, setting_sd=0.012, probability=0.8)
    shares = found.to_frame().probability.to_numpy()
    assert 0 < np.argmax(shares) < len(shares) - 1
    # Rigid, the set point is the deformation: normal, 0.02 mm to both ends.
    inside = 1.0 - 2.0 * norm.sf(0.02 / 0.012)
    assert shares[-1] == pytest.approx(inside, abs=0.03)
    assert shares[-1] < max(shares) - 0.02


def test_correlated_draws_are_less_certain():
    gear = known(4000)
    size = {n: replace(d, ess_tail=1200.0) for n, d in gear.diagnoses.items()}
    found = wave_generator(replace(gear, diagnoses=size), WINDOW)
    assert max(one.no_jam for one in found.springs) == 1.0 - 0.5 / 1200.0


def test_a_generator_that_pulls_is_the_mirror_of_one_that_presses():
    gear = batch(6, 400)
    asked = {"temperatures": [-20.0, 80.0], "setting_sd": 0.003, "probability": 0.95}
    found = wave_generator(gear, WINDOW, **asked)
    other = wave_generator(mirrored(gear), (-0.42, -0.38), **asked)
    for one, two in zip(found.springs, other.springs, strict=True):
        assert two.interference_mm == pytest.approx(-one.interference_mm, rel=1e-9)
        assert two.probability == pytest.approx(one.probability, rel=1e-9)
        assert (two.zero_backlash, two.no_jam) == (one.zero_backlash, one.no_jam)
    assert any(one.zero_backlash != one.no_jam for one in found.springs)
    for one, two in zip(found.force_N, other.force_N, strict=True):
        assert two.lo == pytest.approx(-one.hi, rel=1e-9)
    assert other.stress.stress_MPa.lo == pytest.approx(found.stress.stress_MPa.lo)
    for sense, result in ((1, found), (-1, other)):
        (balance,) = result.charts()["design"].panels
        (span,) = (mark for mark in balance.marks if isinstance(mark, Span))
        assert (span.low, span.high) == result.asked.window_mm
        bands = [mark for mark in balance.marks if isinstance(mark, Band)]
        assert len(bands) == 2 and all(np.all(sense * b.low > 0.0) for b in bands)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"window": (0.42, 0.38)}, "0.42:0.38 is empty"),
        ({"window": (np.nan, 0.4)}, "nan mm does not lie"),
        ({"temperatures": [-300.0]}, "absolute zero"),
        ({"window": (-0.1, 0.4)}, "-0.1:0.4 contains zero"),
        ({"window": (0.399, 0.401), "setting_sd": 0.01}, "no spring rate between"),
        ({"probability": 0.9999}, "cannot be estimated from 1000 independent draws"),
        ({"setting_sd": -1.0}, "-1 mm does not lie between 0 and 1000"),
        ({"temperatures": [2900.0]}, "Young's modulus would change by half"),
        ({"tolerances": {"wall": 0.1}}, "unknown choice 'wall'"),
        ({"models": bent(1000, -2.0)}, "does not grow with deformation"),
    ],
)
def test_bad_input_is_refused(changed, words):
    with pytest.raises(InputError) as refused:
        wave_generator(**{"models": known(), "window": WINDOW, **changed})
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(wave_generator).parameters}
