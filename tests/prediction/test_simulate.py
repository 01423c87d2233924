"""Forces of members against closed forms and against brute-force sampling."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    single,
    with_discrepancy,
    written_posterior,
)

from hdcal.data.records import Geometry
from hdcal.physics.theory import THEORIES
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.forces import force_of, grid_records
from hdcal.prediction.joint import joint
from hdcal.prediction.simulate import simulate

AT = 0.4
FORCE_OF = jax.jit(force_of, static_argnames="quantity")


def simulated(posterior, population="readings", *, at=AT, warm=20.0, **how):
    return simulate(joint(posterior), Conditions.of(at, warm, **how), population)


def line(draws: dict, at: float = AT) -> np.ndarray:
    """Return the straight model's load without the zero of the gauge."""
    return draws["stiffness"] * (at - draws["deformation_offset"])


def straight(members, sign: float = 1.0) -> np.ndarray:
    """Return the mean of each draw without the bend."""
    return sign * (members.centre - members.common["bend"])[:, 0]


def test_readings_of_one_gear_are_the_line_and_its_noise():
    one = single()
    found, draws = simulated(one), one.draws
    expected = line(draws) + draws["force_offset"]
    np.testing.assert_allclose(straight(found), expected, rtol=1e-9)
    np.testing.assert_allclose(found.sd[:, 0, 0], draws["sigma"], rtol=1e-9)
    np.testing.assert_allclose(found.scatter["noise"][:, 0], draws["sigma"] ** 2)
    warm = straight(simulated(single(compensated()), warm=60.0))
    shrunk = expected - line(draws) * 40.0 * draws["alpha"]
    np.testing.assert_allclose(warm, shrunk, rtol=1e-9)


def test_the_centre_of_a_population_is_sd_over_root_n_from_that_of_the_tested():
    gears = batch(6, 4000)
    draws, load = gears.draws, line(gears.draws)
    readings, mountings, specimens = (
        simulated(gears, population)
        for population in ("readings", "mountings", "specimens")
    )
    zero, stiff = draws["run_offset_sd"], draws["specimen_sd"]
    tested = straight(readings)
    for found, sd in (
        (mountings, zero),
        (specimens, np.hypot(zero, load * stiff)),
    ):
        score = (straight(found) - tested) / (sd / 6.0**0.5)
        assert score.std() == pytest.approx(1.0, abs=0.03)
        assert abs(score.mean()) < 0.03
        variance = sum(found.scatter.values())[:, 0]
        np.testing.assert_allclose(variance, draws["sigma"] ** 2 + sd**2, rtol=1e-6)
        np.testing.assert_allclose(found.sd[:, 0, 0] ** 2, variance, rtol=1e-9)
    assert mountings.scatter["gear"].max() == 0.0
    assert readings.scatter["mounting"].max() == 0.0
    # A mounting has no part in a load on the gear.
    assert simulated(gears, "mountings", quantity="load").sd.max() == 0.0


@pytest.mark.parametrize("quantity", ["reading", "load", "gear"])
def test_a_quantity_is_that_of_each_draw_by_itself(quantity: str):
    """Zero, compliance of the rig and zero of the deformation belong to the reading."""
    case, count = ramp_case(known={"readings of the rig alone"}), 40
    own = {
        "deformation_offset": np.full(count, 0.01),
        "rig_compliance.compliance": np.full(count, 1e-3),
    }
    posterior = written_posterior(
        case, plain_draws(case, count) | own, effects=["rig_compliance"]
    )
    found, draws = simulated(posterior, quantity=quantity), posterior.draws
    stiffness, zero = draws["stiffness"], 0.01
    if quantity == "gear":
        expected = stiffness * AT
    else:
        expected = stiffness / (1.0 + 1e-3 * stiffness) * (AT - zero)
        expected += draws["force_offset"] if quantity == "reading" else 0.0
    np.testing.assert_allclose(straight(found), expected, rtol=1e-9)
    assert (found.sd.max() > 0.0) == (quantity == "reading")


def test_nothing_grows_between_rest_and_the_tested_range_of_a_gear():
    """The free shape is known without force, on the way to the other side too."""
    for make in (single, with_discrepancy):
        places = [-1e-6, 1e-3, 0.02, 0.3, 0.9]
        bend = simulated(make(size=200), at=places, quantity="gear").common["bend"]
        np.testing.assert_allclose(bend[:, :2], bend[:, [2, 2]], atol=0.02)
        assert bend[:, 4].std() > 3.0 * bend[:, 3].std()


def test_the_rig_drifts_outside_the_tested_temperatures_by_its_priors():
    x = 2000
    found = simulated(single(size=x), warm=np.array([20.0, 80.0]), at=[AT, AT])
    zero, frame = found.common["zero_drift"], found.common["frame_drift"]
    assert not zero[:, 0].any() and not frame[:, 0].any()
    # The shipped priors: 0.1 N/K and 1 µm/K.
    assert zero[:, 1].std() == pytest.approx(6.0, rel=0.02)
    assert frame[:, 1].std() == pytest.approx(0.06, rel=0.02)
    draws = single(size=x).draws
    loss = 1.0 - 60.0 * draws["alpha"]
    warm = found.centre[:, 1] - found.common["bend"][:, 1]
    moved = draws["stiffness"] * loss * (AT + frame[:, 1] - draws["deformation_offset"])
    expected = moved + zero[:, 1] + draws["force_offset"]
    np.testing.assert_allclose(warm, expected, rtol=1e-9)
    load = simulated(single(size=200), warm=80.0, quantity="load").common
    assert not load["zero_drift"].any() and not load["frame_drift"].any()


def test_the_rig_drifts_by_the_kelvins_outside_the_tested_temperatures():
    case = ramp_case(temperature=np.linspace(20.0, 60.0, 30), known={"temperature"})
    warm = np.array([0.0, 20.0, 40.0, 60.0, 70.0])
    posterior = written_posterior(case, plain_draws(case, 400))
    drift = simulated(posterior, warm=warm, at=np.full(5, AT)).common["zero_drift"]
    per_kelvin = drift[:, 4] / 10.0
    expected = np.outer(per_kelvin, [-20.0, 0.0, 0.0, 0.0, 10.0])
    assert per_kelvin.std() > 0.05
    np.testing.assert_allclose(drift, expected, rtol=1e-9)


SIZES = {"wall_thickness": 0.02, "radius": 0.05}


def drawn_factors(geometry: Geometry, tolerances: dict, count: int = 200_000):
    """Return relative stiffness of gears with sizes uniform in their tolerances."""
    rng = np.random.default_rng(0)
    moved = {
        name: getattr(geometry, name) + by * rng.uniform(-1.0, 1.0, count)
        for name, by in tolerances.items()
    }
    ring = THEORIES["ring"]
    return np.asarray(ring(replace(geometry, **moved), 1.0) / ring(geometry, 1.0))


def test_tolerances_widen_as_brute_force_says():
    one, rng = single(size=400), np.random.default_rng(1)
    found = simulated(one, tolerances=SIZES)
    drawn = rng.choice(drawn_factors(one.case.gear.geometry, SIZES), (400, 4000))
    noise = one.draws["sigma"][:, None] * rng.normal(size=drawn.shape)
    zero = one.draws["force_offset"] + found.common["bend"][:, 0]
    force = line(one.draws)[:, None] * drawn + zero[:, None] + noise
    for level in (0.01, 0.5, 0.99):
        expected = np.quantile(force, level, axis=1)
        np.testing.assert_allclose(found.quantile(level)[:, 0], expected, rtol=0.012)
    by_size = sum(found.scatter[name] for name in SIZES)[:, 0]
    total = (line(one.draws)[:, None] * drawn).var(axis=1)
    np.testing.assert_allclose(by_size, total, rtol=0.08)
    # The wall enters with its third power, the radius with its third as well.
    ratio = found.scatter["wall_thickness"] / found.scatter["radius"]
    wall, radius = 0.02 / 0.68, 0.05 / 40.0
    np.testing.assert_allclose(ratio, (wall / radius) ** 2, rtol=0.05)


def test_gears_through_a_curved_force_keep_the_slope_there():
    gears, size = batch(6, 40), 40
    curvature = {"force_saturation.curvature": np.full(size, 2e-4)}
    draws = {**gears.draws, **curvature}
    curved = written_posterior(gears.case, draws, effects=["force_saturation"])
    found = simulated(curved, "specimens")
    rows = grid_records(np.array([AT]), np.array([20.0]), np.ones(1), 0.0)
    gear = found.common["gear"][:, 0]
    for one in (0, 7):
        value = {name: v[one] for name, v in joint(curved).draws.items()}
        ends = [
            float(
                FORCE_OF(curved.problem, value, rows, factor=1.0 + gear[one] + d)[0][0]
            )
            for d in (-1e-4, 1e-4)
        ]
        slope = (ends[1] - ends[0]) / 2e-4
        own = (slope * draws["specimen_sd"][one]) ** 2
        assert found.scatter["gear"][one, 0] == pytest.approx(own, rel=1e-5)


LOOPS = {
    "hysteresis": {"force": 6.0, "reach": 0.1},
    "plastic_yield": {"softening": 0.2, "yield_deformation": 0.3},
}


@pytest.mark.parametrize("name", LOOPS)
def test_unloading_begins_at_the_largest_tested_deformation(name: str):
    """Rows are of gears of their own: the densely sampled path leads to the same."""
    case, count = ramp_case(known={"unloading"}), 4
    sizes = {f"{name}.{site}": value for site, value in LOOPS[name].items()}
    draws = {site: v[0] for site, v in plain_draws(case, 1).items()} | sizes
    draws = {site: np.full(count, v) for site, v in draws.items()}
    known = written_posterior(case, draws, effects=[name])
    value = {site: v[0] for site, v in known.draws.items()}
    at = np.array([0.4, 0.1, 0.6])
    found = {back: simulated(known, at=at, unloading=back) for back in (False, True)}
    for row, place in enumerate(at):
        up = np.linspace(0.0, place, 300)
        far = max(place, 0.54)
        down = np.append(np.linspace(0.0, far, 300), np.linspace(far, place, 300))
        for back, along in ((False, up), (True, down)):
            sense = np.sign(np.diff(along, prepend=-1.0))
            sense = np.where(sense == 0.0, -1.0, sense)
            none = np.zeros(len(along), dtype=int)
            path = grid_records(along, np.full(len(along), 20.0), sense, 0.0, none)
            expected = float(FORCE_OF(known.problem, value, path)[0][-1])
            centre = found[back].centre - found[back].common["bend"]
            assert centre[0, row] == pytest.approx(expected, abs=1e-6), (back, place)
    gap = found[False].centre - found[True].centre
    assert np.all(gap[:, :2] > 1.0)
