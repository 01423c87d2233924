"""The spring is the softest that keeps the window, and its probabilities are true."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from designs import bent, known
from posteriors import single
from scipy.optimize import brentq
from scipy.stats import norm

from hdcal.design.design_draws import design_draws
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.wave_generator import wave_generator as module
from hdcal.design.wave_generator.springs import best_common, judge, set_points
from hdcal.design.wave_generator.wave_generator import wave_generator
from hdcal.errors import InputError
from hdcal.inference.model_average import ModelAverage
from hdcal.prediction.engine.causes import causes_of, independent_draws
from hdcal.report.chart_spec import Band, Points, Span

WINDOW = (0.38, 0.42)


@pytest.fixture
def given(monkeypatch):
    """Let draws stand in for a calibration."""

    def use(draws):
        monkeypatch.setattr(module, "design_draws", lambda source, seed: draws)
        return draws

    return use


def springs_of(stiffness):
    """Return the forces of straight gears: [end of the window, temperature, draw]."""
    return np.array(WINDOW)[:, None, None] * stiffness[None, None, :]


def test_counting_intervals_is_solving_the_balance():
    draws = bent(40)
    gears = next_gear(draws, {"wall_thickness_mm": 0.02}).gears
    levels = np.array([-20.0, 80.0])
    forces = NextGear(gears).forces(np.array(WINDOW), levels)
    rate, x = 500.0, 0.56
    low, high = set_points(rate, WINDOW, forces)
    for draw in range(draws.size):
        alone = replace(
            gears,
            values={k: v[draw : draw + 1] for k, v in gears.values.items()},
            shifts={k: v[draw : draw + 1] for k, v in gears.shifts.items()},
            deviation=gears.deviation[draw : draw + 1],
        )

        def left(at, level, own=alone):
            force = NextGear(own).forces(np.array([at]), np.array([level]))
            return rate * (x - at) - force[0, 0, 0]

        rests = [brentq(left, 1e-3, x, args=(level,), xtol=1e-10) for level in levels]
        inside = WINDOW[0] <= min(rests) and max(rests) <= WINDOW[1]
        assert inside == (low[draw] <= x <= high[draw])
        if draw > 8:
            break


def test_the_best_common_point_lies_in_most_intervals():
    random = np.random.default_rng(0)
    for _ in range(50):
        low = random.normal(size=30)
        high = low + random.normal(0.5, 1.0, size=30)

        def count(x, low=low, high=high):
            return np.count_nonzero((low <= x) & (x <= high))

        # The best count is met at one of the intervals' own starts.
        assert count(best_common(low, high)) == max(map(count, low))
    assert best_common(np.array([0.0, 1.0]), np.array([3.0, 5.0])) == 2.0
    assert np.isfinite(best_common(np.array([1.0]), np.array([0.0])))


@pytest.mark.parametrize("rate", [0.01, 20.0, 200.0, 1e5])
def test_the_probability_is_that_of_normal_gears(rate):
    """Straight gears of stiffness N(200, 10): inside when s lies between two lines."""
    draws = 200_000
    stiffness = np.random.default_rng(0).normal(200.0, 10.0, draws)
    spring = judge(rate, WINDOW, springs_of(stiffness), np.zeros(draws))
    x = spring.interference
    # ω ≥ lo ⇔ s ≤ c (x − lo)/lo, ω ≤ hi ⇔ s ≥ c (x − hi)/hi.
    most, least = (rate * (x - end) / end for end in WINDOW)
    gears = norm(200.0, 10.0)
    true = gears.cdf(most) - gears.cdf(least)
    error = np.sqrt(true * (1.0 - true) / draws)
    assert spring.together == pytest.approx(true, abs=4.0 * error + 1e-12)
    assert spring.no_backlash == pytest.approx(gears.cdf(most), abs=4e-3)

    # No other set point is better than the one that was chosen.
    def at(x):
        return gears.cdf(rate * (x / WINDOW[0] - 1.0)) - gears.cdf(
            rate * (x / WINDOW[1] - 1.0)
        )

    others = x + np.linspace(-0.2, 0.2, 401) * (WINDOW[1] - WINDOW[0] + 20.0 / rate)
    assert np.max(at(others)) <= true + 3e-3
    if rate == 0.01:  # force control: one force for all gears
        assert true == pytest.approx(0.682, abs=0.01)
    if rate == 1e5:  # displacement control
        assert spring.together == 1.0


def test_choosing_on_the_same_draws_has_little_bias():
    """With 4000 draws the chosen point's true probability is what was counted."""
    gears, gaps = norm(200.0, 10.0), []
    for seed in range(40):
        stiffness = gears.rvs(4000, random_state=seed)
        spring = judge(100.0, WINDOW, springs_of(stiffness), np.zeros(4000))
        most, least = (100.0 * (spring.interference / end - 1.0) for end in WINDOW)
        gaps.append(spring.together - (gears.cdf(most) - gears.cdf(least)))
    error = np.sqrt(0.8 * 0.2 / 4000)
    assert np.mean(gaps) < error
    # The same count with 40 draws has a bias that the test would detect.
    stiffness = gears.rvs(40, random_state=0)
    spring = judge(100.0, WINDOW, springs_of(stiffness), np.zeros(40))
    most, least = (100.0 * (spring.interference / end - 1.0) for end in WINDOW)
    assert spring.together - (gears.cdf(most) - gears.cdf(least)) > 3.0 * error


def test_the_softest_spring_that_meets_the_requirement(given):
    draws = given(known(2000))
    found = wave_generator(draws.gear, WINDOW, temperatures=[-20.0, 80.0])
    assert found.asked.temperature_C == (-20.0, 20.0, 80.0)
    assert found.chosen.together >= 0.99
    softer = [s for s in found.springs if s.rate < found.chosen.rate]
    assert softer and all(s.together < 0.99 for s in softer)
    rates = [s.rate for s in found.springs]
    assert rates == sorted(rates)
    # With an exact set point a stiffer spring is never worse.
    chances = [s.together for s in found.springs]
    assert np.all(np.diff(chances) > -1e-9)


def test_with_an_error_of_the_set_point_there_is_a_best_rate(given):
    draws = given(known(2000))
    found = wave_generator(draws.gear, WINDOW, setting_sd=0.012, probability=0.8)
    chances = [s.together for s in found.springs]
    best = int(np.argmax(chances))
    assert 0 < best < len(chances) - 1
    assert chances[-1] < max(chances) - 0.02
    # Rigid, the set point is the deformation: normal, 0.02 mm to both ends.
    inside = 1.0 - 2.0 * norm.sf(0.02 / 0.012)
    assert chances[-1] == pytest.approx(inside, abs=0.03)


def test_the_adjusting_range_is_that_of_the_gears(given):
    draws = given(known(20_000))
    found = wave_generator(draws.gear, WINDOW, rates=(100.0, 10_000.0))
    low, high = found.adjusted.interference_mm
    stiffness = draws.values["K"] * 207e3 * draws.problem.unit_stiffness
    own = 0.4 + 0.4 * stiffness / found.chosen.rate
    assert low == pytest.approx(np.quantile(own, 0.005), rel=1e-9)
    assert high == pytest.approx(np.quantile(own, 0.995), rel=1e-9)
    force, more = found.adjusted.preload_N
    assert more / force == pytest.approx(np.exp(2 * 2.576 * 0.05), rel=0.02)
    # All draws are inside, which does not make it certain.
    assert found.adjusted.probability == 1.0 - 0.5 / 20_000
    rest = found.set_point.force_N.median
    assert rest == pytest.approx(0.4 * np.median(stiffness))


def test_the_finding_has_the_best_spring(given):
    draws = given(known(2000))
    with pytest.raises(InputError) as refused:
        wave_generator(draws.gear, (0.399, 0.401), rates=(1.0, 50.0))
    words = str(refused.value)
    assert "no spring rate between 1 and 50 N/mm meets 0.399 … 0.401 mm" in words
    assert "the best is 50 N/mm with 0." in words


def test_correlated_draws_have_a_larger_standard_error(given):
    draws = given(replace(known(2000), effective_size=1200.0))
    answer = wave_generator(draws.gear, WINDOW, probability=0.99)
    share, error = answer.spring.probability, answer.spring.standard_error
    assert error == pytest.approx(np.sqrt(share * (1.0 - share) / 1200.0))
    assert answer.at_temperature[0].no_jam <= 1.0 - 0.5 / 1200.0
    with pytest.raises(InputError, match="2000 draws, equivalent to 1200 independent"):
        wave_generator(draws.gear, WINDOW, probability=0.993)


def test_the_effective_size_of_several_causes_is_that_of_their_mean():
    """The reference is the variance of a share counted among the draws of both."""
    posterior = ModelAverage({"none": (0.7, single()), "x": (0.3, single())})
    found = design_draws(posterior)
    each = [independent_draws(cause) for cause in causes_of(posterior)]
    rng = np.random.default_rng(0)
    counted = [
        0.7 * rng.binomial(int(each[0]), 0.9) / int(each[0])
        + 0.3 * rng.binomial(int(each[1]), 0.9) / int(each[1])
        for _ in range(20_000)
    ]
    assert np.var(counted) == pytest.approx(0.09 / found.independent, rel=0.05)


def _ends(interval) -> tuple[float, float]:
    return interval.lo, interval.hi


def test_the_stress_is_that_of_gears_as_they_are_made(given):
    draws = given(known())
    wide = wave_generator(
        draws.gear, WINDOW, probability=0.5, tolerances={"wall_thickness_mm": 0.1}
    )
    plain = wave_generator(draws.gear, WINDOW, probability=0.5)
    (low, high), (least, most) = (
        _ends(found.stress.stress_MPa) for found in (wide, plain)
    )
    own = draws.gear.geometry.wall_thickness
    # Bending stress grows with the wall: 95 % of a uniform tolerance of it.
    assert (high - low) / most == pytest.approx(2.0 * 0.095 / own, rel=0.2)
    assert most - least < 1e-6 * most


def test_a_force_that_falls_is_refused(given):
    draws = bent(1000)
    slope = np.full(1000, -2.0)
    values = {**draws.values, "progressive_stiffening.slope": slope}
    given(replace(draws, values=values))
    with pytest.raises(InputError, match="does not grow with deformation"):
        wave_generator(draws.gear, WINDOW)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"window": (0.42, 0.38)}, "0.42:0.38 is empty"),
        ({"window": (np.nan, 0.4)}, "nan:0.4 is empty"),
        ({"window": (-0.1, 0.4)}, "-0.1:0.4 contains zero"),
        ({"probability": 0.9999}, "cannot be estimated from 2000 draws"),
        ({"setting_sd": -1.0}, "-1 mm does not lie between 0 and 1000"),
        ({"rates": (5.0, 2.0)}, "no range of spring rates"),
        ({"temperatures": [-300.0]}, "absolute zero"),
        ({"temperatures": [3000.0]}, "half of Young's modulus"),
        ({"tolerances": {"wall": 0.1}}, "unknown key 'wall'"),
    ],
)
def test_bad_input_is_refused(given, changed, words):
    draws = given(known(2000))
    asked = {"window": WINDOW, **changed}
    with pytest.raises(InputError) as refused:
        wave_generator(draws.gear, **asked)
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(wave_generator).parameters}


def test_all_findings_are_reported(given):
    draws = given(known(2000))
    with pytest.raises(InputError) as refused:
        wave_generator(
            draws.gear,
            (0.4, 0.3),
            probability=2.0,
            temperatures=[-300.0],
            tolerances={"wall": 1.0},
        )
    assert len(refused.value.findings) == 4


@pytest.mark.parametrize("sense", [1, -1])
def test_the_softest_spring_fits_inside_the_gear(given, sense):
    draws = given(known(2000))
    window = (0.2, 0.6) if sense > 0 else (-0.6, -0.2)
    found = wave_generator(draws.gear, window, temperatures=[-20.0, 80.0])
    assert found.spring.softest_considered
    radius = draws.gear.geometry.radius
    assert abs(found.spring.interference_mm) < 0.25 * radius
    assert sense * found.spring.interference_mm > 0.0
    with pytest.raises(InputError) as refused:
        wave_generator(draws.gear, window, rates=(1.0, 100.0))
    (finding,) = refused.value.findings
    assert finding.file == "rates" and "radius of 40 mm" in finding.problem
    least = float(finding.remedy.split()[2])
    again = wave_generator(draws.gear, window, rates=(least, 100.0))
    assert again.chosen.rate == least


@pytest.mark.parametrize("sense", [1, -1])
def test_charts_show_window_and_choice(given, sense):
    draws = given(known(400))
    window = WINDOW if sense > 0 else (-0.42, -0.38)
    found = wave_generator(
        draws.gear, window, temperatures=[-20.0, 80.0], probability=0.9
    )
    balance, choice = found.charts()["design"].panels
    (span,) = (mark for mark in balance.marks if isinstance(mark, Span))
    assert (span.low, span.high, span.axis) == (*window, "x")
    gears = [mark for mark in balance.marks if isinstance(mark, Band)]
    assert len(gears) == 2
    assert all(np.all(sense * band.low > 0.0) for band in gears)
    (point,) = (mark for mark in choice.marks if isinstance(mark, Points))
    assert point.x == found.spring.rate_N_per_mm and point.y >= 0.9
    assert len(found.to_frame()) == len(found.curve.rate_N_per_mm)
