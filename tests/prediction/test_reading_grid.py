"""Bounds and chances of readings in steps: those of the readings, not of the force."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import plain_draws, written_posterior
from rigs import make_case, make_gear, make_records
from scipy import stats

import hdcal
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.population_force import population_force
from hdcal.prediction.engine.reading_grid import ReadingGrid, reading_grid

STEP, AT = 0.98, 0.4
RNG = np.random.default_rng(5)


def read(force, origin: float):
    """Return forces as a scale shows them."""
    return origin + STEP * np.round((force - origin) / STEP)


@pytest.mark.parametrize("origin", [0.0, 0.3, -0.45])
def test_limits_and_bounds_are_those_of_rounded_forces(origin: float):
    grid, forces = ReadingGrid(STEP, origin), RNG.normal(80.0, 3.0, 20_000)
    shown = read(forces, origin)
    readings = read(RNG.uniform(74.0, 86.0, 20), origin)
    for limit in [*RNG.uniform(74.0, 86.0, 50), *readings, *np.round(readings, 1)]:
        over, nearest = forces > grid.unrounded(limit), float(read(limit, origin))
        # Written with fewer digits it stands for that reading.
        meant = nearest if round(nearest, 1) == limit else limit
        np.testing.assert_array_equal(over, shown > meant + 1e-9)
    for bound in RNG.uniform(74.0, 86.0, 20):
        upper, lower = grid.upper(bound), grid.lower(bound)
        assert np.mean(shown <= upper + 1e-9) >= np.mean(forces <= bound)
        assert np.mean(shown >= lower - 1e-9) >= np.mean(forces >= bound)
        # And the next reading would promise less.
        assert np.mean(shown <= upper - 0.5 * STEP) <= np.mean(forces <= bound)
        assert np.mean(shown >= lower + 0.5 * STEP) <= np.mean(forces >= bound)


def test_pulled_gears_are_mirrored():
    grid, pulled = ReadingGrid(STEP, 0.3), ReadingGrid(STEP, 0.3).mirrored()
    for place in RNG.uniform(-9.0, 9.0, 20):
        assert pulled.upper(-place) == pytest.approx(-grid.lower(place))


def test_a_force_without_steps_is_what_it_is():
    none = ReadingGrid(0.0, None)
    assert none.unrounded(3.21) == none.upper(3.21) == none.lower(3.21) == 3.21


def rounded_case(origin: float = 0.0, off: float = 0.0, sd: float = 0.3):
    """Return readings in steps, those of the second half off their grid by a share."""
    deformation = np.linspace(0.02, 0.54, 200)
    rng = np.random.default_rng(4)
    exact = 205.0 * deformation - 1.0 + rng.normal(0.0, sd, 200)
    force = read(exact, origin) + off * STEP * (np.arange(200) >= 100)
    return make_case(make_records(deformation, force), make_gear(resolution=STEP))


def test_the_grid_is_where_the_readings_are():
    found = reading_grid(rounded_case(0.3), 1, rounded=True)
    assert found.origin is not None
    steps = (found.origin - 0.3) / STEP
    assert steps == pytest.approx(round(steps), abs=1e-9)
    pulled = reading_grid(rounded_case(0.3), -1, rounded=True)
    assert pulled.origin == pytest.approx(-found.origin)
    assert reading_grid(rounded_case(0.3), 1, rounded=False).step == 0.0


def test_a_slip_of_the_pen_leaves_the_grid():
    case = rounded_case(0.3)
    force = np.array(case.records.force)
    force[::10] += 0.4 * STEP
    slipped = replace(case, records=replace(case.records, force=force))
    whole, some = (reading_grid(one, 1, rounded=True).origin for one in (case, slipped))
    assert some == pytest.approx(whole, abs=1e-9)


def test_readings_on_no_grid_are_bounded_wherever_it_lies():
    grid = reading_grid(rounded_case(off=0.4), 1, rounded=True)
    assert grid == ReadingGrid(STEP, None)
    for origin in np.linspace(-0.49, 0.49, 11):
        known = ReadingGrid(STEP, origin)
        assert grid.unrounded(80.0) <= known.unrounded(80.0)
        assert grid.upper(80.0) >= known.upper(80.0) - 1e-9
        assert grid.lower(80.0) <= known.lower(80.0) + 1e-9


@pytest.fixture(scope="module")
def posterior():
    """Draws about the truth of readings whose steps are three times their noise."""
    case, rng = rounded_case(), np.random.default_rng(6)
    draws = plain_draws(case, 1000)
    stiffness = rng.normal(205.0, 0.1, 1000)
    return written_posterior(
        case,
        draws
        | {
            "K": draws["K"] * stiffness / draws["stiffness"],
            "stiffness": stiffness,
            "force_offset": rng.normal(-1.0, 0.03, 1000),
            "deformation_offset": np.zeros(1000),
            "sigma": 0.3 * np.exp(rng.normal(0.0, 0.05, 1000)),
        },
    )


def test_the_chance_is_that_of_a_reading(posterior):
    """Counted over draws of the posterior, each rounded as the scale does."""
    mean = 205.0 * AT - 1.0
    force = population_force(causes_of(posterior)[0], AT, "readings").mixture()
    rng = np.random.default_rng(0)
    size = (np.asarray(force.mean).shape[0], 400)
    drawn = np.asarray(force.mean) + np.asarray(force.sd) * rng.normal(size=size)
    shown = read(drawn, 0.0)
    for limit in (mean - 0.3, mean + 0.1, mean + 0.5):
        asked = {"limit_force": limit, "sensitivities": False}
        risk = hdcal.margin(posterior, AT, **asked).worst.exceedance
        counted = np.mean(shown > limit)
        assert risk.probability == pytest.approx(counted, rel=0.05, abs=2e-4)
        # The next value read above it lies up to a step away.
        edge = STEP * (np.floor(limit / STEP) + 0.5)
        assert risk.lo <= stats.norm.sf(edge, mean, 0.3) <= risk.hi
        assert abs(np.mean(drawn > limit) - counted) > 0.03


def test_bounds_are_readings_and_hold_what_they_promise(posterior):
    found = hdcal.margin(posterior, AT, content=0.99, sensitivities=False)
    worst, mean = found.worst, 205.0 * AT - 1.0
    for bound in (worst.lower_bound_N, worst.upper_bound_N, worst.capacity_N):
        assert bound / STEP == pytest.approx(round(bound / STEP), abs=1e-6)
    shown = read(np.random.default_rng(1).normal(mean, 0.3, 100_000), 0.0)
    assert np.mean(shown <= worst.upper_bound_N + 1e-6) >= 0.99
    assert np.mean(shown >= worst.lower_bound_N - 1e-6) >= 0.99
    # Two steps less would not, nor is one more than the confidence asks for.
    assert np.mean(shown <= worst.upper_bound_N - 1.5 * STEP) < 0.99
    assert worst.upper_bound_N - worst.capacity_median_N <= 1.5 * STEP


@pytest.mark.thorough
@pytest.mark.parametrize("limits", [5, 11])
@pytest.mark.parametrize("rule", ["simple", "guarded"])
def test_a_decision_does_not_contradict_its_risk(rule, limits, posterior):
    said = set()
    for limit in np.linspace(79.5, 83.5, limits):
        asked = {"limit_force": limit, "rule": rule, "sensitivities": False}
        found = hdcal.margin(posterior, AT, **asked).decision
        risk = 0.5 if rule == "simple" else 0.025
        said.add(found.statement)
        if found.statement == "conforms":
            assert found.false_accept_risk <= risk + 0.01, limit
        elif found.statement == "does not conform":
            assert found.false_accept_risk >= 1.0 - risk - 0.01, limit
    assert said >= {"conforms", "does not conform"}


@pytest.mark.thorough
def test_a_limit_as_printed_is_the_reading_it_stands_for(posterior):
    risks = [
        hdcal.margin(
            posterior, AT, limit_force=limit, sensitivities=False
        ).worst.exceedance.probability
        for limit in (82.3, 82.32, 82.36)
    ]
    assert risks[0] == risks[1] == risks[2]


def test_the_deformation_reached_is_that_of_the_reading(posterior):
    limit = 82.32
    there = hdcal.margin(posterior, AT, given_force=limit, sensitivities=False).reached
    for place in (there.lower_bound_mm, there.upper_bound_mm):
        exact = 205.0 * place - 1.0
        over = stats.norm.sf(limit + 0.5 * STEP, exact, 0.3)
        assert 0.0 <= min(over, 1.0 - over) < 0.01
    # A hair's breadth away from where one reading turns into the next.
    near = there.lower_bound_mm - 1e-6
    back = hdcal.margin(posterior, near, sensitivities=False).worst
    assert back.upper_bound_N == pytest.approx(limit, abs=1e-6)
