"""Margins: what the numbers are, whose they are, and what is refused."""

from dataclasses import asdict

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    regressed,
    single,
    stiffer,
    with_leftover,
    written_posterior,
)
from rigs import make_gear
from scipy import signal, stats

import hdcal
from hdcal.errors import InputError
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.mixture import Mixture
from hdcal.prediction.engine.population import widest
from hdcal.prediction.engine.population_force import SCORES, population_force
from hdcal.prediction.engine.sizes import shifted, stiffness_ratio, tolerance_strata

QUICK = {"sensitivities": False}
QUANTILE = jax.jit(Mixture.quantile)


@pytest.fixture(scope="module")
def gears():
    return batch()


@pytest.fixture(scope="module")
def one():
    return single()


def members(posterior, at: float, *, count: int = 2000, seed: int = 3) -> np.ndarray:
    """Draw forces of new gears in new mountings, many for every draw [draw, member]."""
    rng, d = np.random.default_rng(seed), posterior.draws
    size, runs = len(d["K"]), posterior.problem.runs
    # The centre of the population is as the margin has it, the members are not.
    force = population_force(*causes_of(posterior), at, "specimens")
    of_gears, of_runs = force.cause.values[SCORES].T
    stiff = rng.normal(of_gears[:, None] / np.sqrt(runs), 1.0, (size, count))
    zero = rng.normal(of_runs[:, None] / np.sqrt(runs), 1.0, (size, count))
    load = d["stiffness"] * (at - d["deformation_offset"])
    force = load[:, None] * (1.0 + d["specimen_sd"][:, None] * stiff)
    zero = d["force_offset"][:, None] + d["run_offset_sd"][:, None] * zero
    return force + zero + d["sigma"][:, None] * rng.normal(size=(size, count))


def test_the_numbers_are_those_of_brute_force(gears):
    found = hdcal.margin(gears, 0.4, limit_force=95.0, content=0.9, **QUICK)
    drawn, level = members(gears, 0.4), found.worst
    assert found.basis == "B-basis" and found.population == "specimens"
    upper = np.quantile(np.quantile(drawn, 0.9, axis=1), 0.95)
    lower = np.quantile(np.quantile(drawn, 0.1, axis=1), 0.05)
    assert level.upper_bound_N == pytest.approx(upper, rel=5e-3)
    assert level.lower_bound_N == pytest.approx(lower, rel=5e-3)
    ends = np.quantile(drawn, [0.025, 0.5, 0.975])
    got = [level.member_N.lo, level.member_N.median, level.member_N.hi]
    np.testing.assert_allclose(got, ends, rtol=5e-3)
    risk = level.exceedance
    assert risk.probability == pytest.approx(np.mean(drawn > 95.0), rel=0.03)
    assert risk.lo < risk.probability < risk.hi
    assert risk.beta == pytest.approx(-stats.norm.ppf(risk.probability))
    assert risk.beta_lo < risk.beta_at_confidence < risk.beta < risk.beta_hi
    assert level.capacity_N == level.upper_bound_N
    expected = np.quantile(drawn, 0.9)
    assert level.capacity_predictive_N == pytest.approx(expected, rel=5e-3)
    members_need = np.quantile(drawn, 0.9, axis=1)
    middle = np.median(members_need)
    assert level.capacity_median_N == pytest.approx(middle, rel=5e-3)


def test_a_capacity_meets_what_it_was_asked_to(gears):
    asked = hdcal.margin(gears, 0.4, required_probability=0.999, **QUICK).worst
    expected, sure = asked.capacity_predictive_N, asked.capacity_N
    risk = hdcal.margin(gears, 0.4, limit_force=expected, **QUICK).worst.exceedance
    assert risk.probability == pytest.approx(1e-3, rel=1e-4)
    risk = hdcal.margin(gears, 0.4, limit_force=sure, **QUICK).worst.exceedance
    assert risk.at_confidence == pytest.approx(1e-3, rel=1e-2)


@pytest.mark.parametrize("limit", [0.02, 90.0])
def test_no_probability_is_nothing_or_all(one, limit: float):
    risk = hdcal.margin(one, 0.4, limit_force=80.0 * limit, **QUICK).worst.exceedance
    for share in (risk.probability, risk.lo, risk.hi, risk.at_confidence):
        assert 0.0 < share < 1.0
    for beta in (risk.beta, risk.beta_lo, risk.beta_hi, risk.beta_at_confidence):
        assert np.isfinite(beta) and abs(beta) > 8.0


def test_the_population_is_the_widest_that_was_tested(gears, one):
    assert (widest(gears.problem), widest(one.problem)) == ("specimens", "readings")
    found = [
        hdcal.margin(gears, 0.4, population=p, **QUICK)
        for p in ("readings", "mountings", "specimens")
    ]
    bounds = [each.worst.upper_bound_N for each in found]
    assert bounds == sorted(bounds)
    assert [each.basis for each in found] == ["", "", "A-basis"]
    alone = hdcal.margin(one, 0.4, **QUICK)
    assert alone.basis == ""


@pytest.mark.parametrize("population", ["mountings", "specimens"])
def test_one_member_is_no_population(one, population):
    with pytest.raises(InputError, match="which says nothing of how much others"):
        hdcal.margin(one, 0.4, population=population)


def test_two_gears_are_a_population_one_is_not():
    assert widest(batch(2, 20).problem) == "specimens"


def test_the_load_has_no_zero_and_no_noise(one):
    found = hdcal.margin(one, 0.4, quantity="load", **QUICK)
    draws = one.draws
    load = draws["stiffness"] * (0.4 - draws["deformation_offset"])
    assert found.worst.upper_bound_N == pytest.approx(np.quantile(load, 0.95), rel=1e-4)
    # Nothing scatters: what any share needs is what all need.
    assert found.worst.force_N.hi == pytest.approx(found.worst.member_N.hi, rel=1e-3)


def test_the_worst_temperature_counts():
    """The rig does not drift: the gear alone is stiffer where it is cold."""
    warm = {"temperature": [-20.0, 20.0, 80.0]}
    found = hdcal.margin(single(compensated()), 0.4, **warm, **QUICK)
    assert found.worst.temperature_C == -20.0
    bounds = [level.upper_bound_N for level in found.levels]
    assert found.worst.upper_bound_N == pytest.approx(max(bounds), rel=1e-6)
    lows = [level.lower_bound_N for level in found.levels]
    assert found.worst.lower_bound_N == pytest.approx(min(lows), rel=1e-6)
    drop = bounds[0] - bounds[2]
    assert drop == pytest.approx(205.0 * 0.4 * 3e-4 * 100.0, abs=0.8)
    assert [level.tested for level in found.levels] == [False, True, False]


def test_tolerances_widen_as_brute_force_says(one):
    sizes = {"wall_thickness": 0.02, "radius": 0.05}
    geometry = one.case.gear.geometry
    strata = tolerance_strata(geometry, sizes, "ring")
    rng = np.random.default_rng(0)
    shifts = {n: t * rng.uniform(-1.0, 1.0, 200_000) for n, t in sizes.items()}
    made = shifted(geometry, shifts)
    drawn = np.asarray(stiffness_ratio(made, geometry, "ring"))
    assert strata.weight @ strata.factor == pytest.approx(drawn.mean(), abs=2e-4)
    square = strata.weight @ (strata.factor**2 + strata.width**2)
    assert square == pytest.approx(np.mean(drawn**2), abs=4e-4)
    asked = {f"{name}_mm": size for name, size in sizes.items()}
    found = hdcal.margin(one, 0.4, tolerances=asked, **QUICK)
    draws, size = one.draws, len(one.draws["K"])
    load = draws["stiffness"] * (0.4 - draws["deformation_offset"])
    factor = rng.choice(drawn, (size, 500))
    noise = draws["sigma"][:, None] * rng.normal(size=(size, 500))
    force = load[:, None] * factor + draws["force_offset"][:, None] + noise
    upper = np.quantile(np.quantile(force, 0.99, axis=1), 0.95)
    assert found.worst.upper_bound_N == pytest.approx(upper, rel=3e-3)


def test_scatter_through_a_bent_force_is_that_of_brute_force():
    """Where the force is not linear in the stiffness, the split normal follows it."""
    gears = batch(6, 40)
    curvature = {"force_saturation.curvature": np.full(40, 2e-5)}
    draws = {**gears.draws, **curvature, "specimen_sd": np.full(40, 0.08)}
    bent = written_posterior(gears.case, draws, effects=["force_saturation"])
    future = population_force(*causes_of(bent), 0.4, "specimens")
    problem = bent.problem
    row = {name: values[7] for name, values in future.cause.values.items()}
    rng = np.random.default_rng(1)
    gear, zero, noise = rng.normal(size=(3, 100_000))
    gear, zero = (
        score + centre / np.sqrt(6.0)
        for score, centre in zip((gear, zero), row[SCORES], strict=False)
    )
    records = grid_records(np.array([0.4]), np.array([20.0]), np.ones(1), 0.0)

    def mean(factor):
        return force_of(problem, row, records, factor=factor)[0][0]

    factor = jnp.asarray(1.0 + row["specimen_sd"] * gear)
    force = np.asarray(jax.jit(jax.vmap(mean))(factor))
    drawn = force + row["run_offset_sd"] * zero + row["sigma"] * noise
    found = future.mixture()
    for share in (0.01, 0.5, 0.99):
        expected = np.quantile(drawn, share)
        assert float(QUANTILE(found, share)[7]) == pytest.approx(expected, rel=3e-3)
    # The tangent alone would miss it: the force bends by newtons over the gears.
    straight = mean(1.0) + (mean(1.001) - mean(0.999)) / 2e-3 * (factor - 1.0)
    assert np.max(np.abs(straight - force)) > 2.0


def test_the_inverse_is_the_other_way_round(gears):
    found = hdcal.margin(gears, 0.4, given_force=80.0, content=0.9, **QUICK).reached
    # At the deformation that 90 % reach at least, 90 % need at most this force.
    again = hdcal.margin(gears, found.lower_bound_mm, content=0.9, **QUICK).worst
    assert again.upper_bound_N == pytest.approx(80.0, rel=2e-3)
    again = hdcal.margin(gears, found.upper_bound_mm, content=0.9, **QUICK).worst
    assert again.lower_bound_N == pytest.approx(80.0, rel=2e-3)
    again = hdcal.margin(gears, found.median_mm, **QUICK).worst
    assert again.force_N.median == pytest.approx(80.0, rel=1e-3)


def test_what_is_reached_first_is_reached():
    """Correlated readings know little of a bend: far out a share comes back again."""
    rng = np.random.default_rng(0)
    place = np.linspace(0.01, 0.54, 60)
    noise = signal.lfilter([0.96], [1.0, -0.8], rng.normal(size=260))[200:]
    found = regressed(place, 150.0 * place - 1.0 + noise, rng)
    reached = hdcal.margin(found, 0.4, given_force=60.0, **QUICK).reached
    assert reached.lower_bound_mm < reached.median_mm < reached.upper_bound_mm < 0.45
    again = hdcal.margin(found, reached.upper_bound_mm, **QUICK).worst
    assert again.lower_bound_N == pytest.approx(60.0, rel=2e-3)


def test_a_force_that_nothing_reaches_is_said(gears):
    found = hdcal.margin(gears, 0.4, given_force=600.0, **QUICK)
    assert found.reached.median_mm is found.reached.lower_bound_mm is None
    assert not found.reached.tested


@pytest.mark.thorough
def test_towards_the_other_sense_no_spread_grows():
    """Of a gear pushed and pulled, 60 N are reached as if it had only been pushed."""
    rng = np.random.default_rng(0)
    place = np.linspace(-0.5, 0.5, 60)
    noise = signal.lfilter([1.44], [1.0, -0.8], rng.normal(size=260))[200:]
    found = regressed(place, 150.0 * place - 1.0 + noise, rng)
    reached = hdcal.margin(found, 0.4, given_force=60.0, **QUICK).reached
    assert reached.searched_mm == pytest.approx((-0.5, 1.0))
    assert 0.3 < reached.lower_bound_mm < reached.upper_bound_mm < 0.5


def test_beyond_the_tested_deformation_a_bend_widens(one):
    inside = hdcal.margin(one, 0.5, **QUICK)
    beyond = hdcal.margin(one, 0.7, **QUICK)
    assert inside.extrapolated == ()
    assert len(beyond.extrapolated) == 1

    def width(found):
        return found.worst.force_N.hi - found.worst.force_N.lo

    # More than the line alone, which widens in proportion.
    assert width(beyond) > width(inside) * 0.7 / 0.5 + 0.5
    assert not beyond.worst.tested


def test_a_fitted_leftover_is_used_and_goes_on_without_a_step():
    posterior = with_leftover()
    ends = [0.54 - 1e-7, 0.54, 0.54 + 1e-7]
    inside, edge, beyond = (hdcal.margin(posterior, at, **QUICK) for at in ends)
    widths = [
        found.worst.force_N.hi - found.worst.force_N.lo
        for found in (inside, edge, beyond)
    ]
    np.testing.assert_allclose(widths, widths[1], rtol=1e-3)
    bands = hdcal.predict(posterior, [0.54])
    got = edge.worst.force_N
    assert got.lo == pytest.approx(bands.with_gap_lo_N[0], rel=1e-3)
    assert got.hi == pytest.approx(bands.with_gap_hi_N[0], rel=1e-3)


def test_causes_are_averaged_by_probability(gears):
    other = stiffer(gears, 1.1)
    both = hdcal.margin([(3.0, gears), (1.0, other)], 0.4, limit_force=95.0, **QUICK)
    each = [hdcal.margin(p, 0.4, limit_force=95.0, **QUICK) for p in (gears, other)]
    for model, alone, share in zip(both.models, each, (0.75, 0.25), strict=True):
        assert model.probability == share
        assert model.upper_bound_N == pytest.approx(alone.worst.upper_bound_N, rel=1e-9)
    chances = [found.worst.exceedance.probability for found in each]
    mean = 0.75 * chances[0] + 0.25 * chances[1]
    assert both.worst.exceedance.probability == pytest.approx(mean, rel=1e-9)
    low, high = (found.worst.upper_bound_N for found in each)
    assert low < both.worst.upper_bound_N < high
    # Twice the same model says what it says alone.
    twice = hdcal.margin([(0.3, gears), (0.7, gears)], 0.4, **QUICK)
    assert twice.worst.upper_bound_N == pytest.approx(low, rel=2e-3)


def test_the_same_seed_gives_the_same_margin(gears):
    first, second, third = (
        asdict(hdcal.margin(gears, 0.4, seed=seed, **QUICK)) for seed in (1, 1, 2)
    )
    assert first == second != third


@pytest.mark.thorough
def test_the_load_height_matters_to_the_cup():
    cup = single(make_gear(theory="cup"), 200)
    plain = hdcal.margin(cup, 0.4, **QUICK)
    wide = hdcal.margin(cup, 0.4, tolerances={"load_height_mm": 3.0}, **QUICK)
    assert wide.worst.upper_bound_N > plain.worst.upper_bound_N + 2.0


@pytest.mark.thorough
def test_unloading_begins_at_the_top():
    case = ramp_case()
    draws = plain_draws(case, 200) | {
        "hysteresis.force": np.full(200, 4.0),
        "hysteresis.reach": np.full(200, 0.05),
    }
    looped = ramp_case(known={"unloading"}, sense=np.tile([1.0, -1.0], 15))
    posterior = written_posterior(looped, draws, effects=["hysteresis"])
    up, down = (
        hdcal.margin(posterior, 0.4, direction=way, quantity="load", **QUICK)
        for way in ("up", "down")
    )
    gap = up.worst.force_N.median - down.worst.force_N.median
    assert gap == pytest.approx(8.0, abs=0.1)
