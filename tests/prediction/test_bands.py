"""Bands: what they hold, where they are tested, and what they refuse."""

from dataclasses import replace
from inspect import signature

import jax
import numpy as np
import pytest
from posteriors import batch, plain_draws, ramp_case, written_posterior
from rigs import cycles, make_case, make_records
from short import SHORT
from slices import slice_of

from hdcal.calibration.calibrate import calibrate
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.bands import bands
from hdcal.prediction.bands.bands import default_bands, predict
from hdcal.prediction.engine.conditions import is_tested
from hdcal.prediction.engine.forces import force_of, grid_records


def reading(records, seed=0):
    noise = np.random.default_rng(seed).normal(0.0, 0.4, len(records.force))
    rise = np.asarray(records.temperature) - 20.0
    slope = 205.0 * (1.0 - 3e-4 * rise)
    friction = 2.0 * np.asarray(records.sense)
    return slope * np.asarray(records.deformation) - 1.0 + friction + noise


@pytest.fixture(scope="module")
def rubbing():
    """Draws about the truth of the readings, friction of 2 N among them."""
    records = cycles(96)
    case = make_case(replace(records, force=reading(records)))
    draws = plain_draws(case, 400) | {"sigma": np.full(400, 0.4)}
    draws["coulomb_friction.force"] = np.full(400, 2.0)
    return written_posterior(case, draws, effects=["coulomb_friction"])


def test_bands_follow_deformation_temperature_and_direction(rubbing):
    up = predict(rubbing, [0.1, 0.4], [20.0, 80.0], "up")
    down = predict(rubbing, [0.1, 0.4], [20.0, 80.0], "down")
    assert list(up.deformation_mm) == [0.1, 0.4, 0.1, 0.4]
    assert list(up.temperature_C) == [20.0, 20.0, 80.0, 80.0]
    loop = up.physics_median_N - down.physics_median_N
    assert loop == pytest.approx(4.0, abs=0.5)
    drop = up.physics_median_N[1] - up.physics_median_N[3]
    assert drop == pytest.approx(205 * 0.4 * 3e-4 * 60, abs=0.5)
    true = 205.0 * 0.4 - 1.0 + 2.0
    assert up.physics_lo_N[1] < true < up.physics_hi_N[1]


def test_bands_are_ordered_and_a_new_reading_is_wider(rubbing):
    found = predict(rubbing, np.linspace(0.0, 0.5, 21))
    assert np.all(found.physics_lo_N < found.physics_median_N)
    assert np.all(found.physics_median_N < found.physics_hi_N)
    assert np.all(found.new_measurement_lo_N < found.physics_lo_N)
    assert np.all(found.new_measurement_hi_N > found.physics_hi_N)
    assert np.all(np.isnan(found.with_gap_median_N))


def test_a_new_reading_covers_new_data(rubbing):
    records = cycles(960)
    rows = (np.asarray(records.sense) > 0) & (records.temperature == 20.0)
    found = predict(rubbing, np.asarray(records.deformation)[rows], [20.0])
    fresh = reading(records, seed=9)[rows]
    hits = (found.new_measurement_lo_N < fresh) & (fresh < found.new_measurement_hi_N)
    assert 0.88 < hits.mean() <= 1.0


def test_tested_means_inside_the_data(rubbing):
    found = predict(rubbing, [0.01, 0.3, 0.6], [20.0, 90.0])
    assert list(found.tested) == [False, True, False, False, False, False]
    loading_only = make_records(np.linspace(0.0, 0.5, 9))
    for sense, inside in ((1.0, True), (-1.0, False)):
        found = is_tested(loading_only, deformation=0.3, temperature=20.0, sense=sense)
        assert bool(found) == inside


def test_blocks_do_not_show(rubbing, monkeypatch):
    grid = np.linspace(0.0, 0.5, 50)
    whole = predict(rubbing, grid)
    monkeypatch.setattr(bands, "_BLOCK", 7)
    pieces = predict(rubbing, grid)
    assert pieces.physics_lo_N == pytest.approx(whole.physics_lo_N, abs=1e-12)


FORCE_OF = jax.jit(force_of)
LOOPS = {
    "hysteresis": {"force": 6.0, "reach": 0.1},
    "plastic_yield": {"softening": 0.2, "yield_deformation": 0.3},
}


@pytest.mark.parametrize("name", slice_of(LOOPS, ["hysteresis"]))
def test_what_remembers_came_its_own_way(name: str, monkeypatch):
    """Each row is of another gear, unloaded from where the tested one was farthest."""
    case, count = ramp_case(known={"unloading"}), 4
    sizes = {f"{name}.{site}": value for site, value in LOOPS[name].items()}
    draws = {site: v[0] for site, v in plain_draws(case, 1).items()} | sizes
    draws = {site: np.full(count, v) for site, v in draws.items()}
    known = written_posterior(case, draws, effects=[name])
    monkeypatch.setattr(bands, "_BLOCK", 2)
    at, far = np.array([0.4, 0.1, 0.25]), 0.54
    found = {way: predict(known, at, direction=way) for way in ("up", "down")}
    for row, place in enumerate(at):
        loaded, back = np.linspace(0.0, far, 300), np.linspace(far, place, 300)
        for way, along in (
            ("up", np.linspace(0.0, place, 300)),
            ("down", np.append(loaded, back)),
        ):
            sense = np.sign(np.diff(along, prepend=-1.0))
            one_gear = np.zeros(len(along), dtype=int)
            path = grid_records(along, np.full(len(along), 20.0), sense, 0.0, one_gear)
            value = {site: v[0] for site, v in known.draws.items()}
            expected = float(FORCE_OF(known.problem, value, path)[0][-1])
            median = found[way].physics_median_N[row]
            assert median == pytest.approx(expected, abs=1e-6), (way, place)
    loop = found["up"].physics_median_N - found["down"].physics_median_N
    assert np.all(loop > 1.0)


def test_the_same_seed_gives_the_same_bands(rubbing):
    first, second, third = (predict(rubbing, [0.3], seed=s) for s in (1, 1, 2))
    assert first.new_measurement_lo_N == second.new_measurement_lo_N
    assert first.new_measurement_lo_N != third.new_measurement_lo_N


def test_default_bands_reach_a_tenth_beyond_each_way_tested(rubbing):
    found = default_bands(rubbing)
    assert set(found.direction) == {"up", "down"}
    assert set(found.temperature_C) == {20.0, 50.0, 80.0}
    assert found.deformation_mm.max() == pytest.approx(1.1 * 0.54)
    assert found.tested.any()
    assert not found.tested.all()


@pytest.mark.parametrize(
    "arguments",
    [
        {"deformation": []},
        {"deformation": [np.nan]},
        {"deformation": [0.1], "temperature": [-300.0]},
        {"deformation": [0.1], "temperature": []},
        {"deformation": [0.1], "direction": "sideways"},
        {"deformation": [0.1], "interval": 1.0},
    ],
)
def test_bad_grids_are_refused(rubbing, arguments):
    with pytest.raises(InputError) as caught:
        predict(rubbing, **arguments)
    assert {f.file for f in caught.value.findings} <= {*signature(predict).parameters}


def test_micrometres_are_refused_where_no_size_tells(rubbing):
    """A spring has no radius, which a deformation could be larger than."""
    case = rubbing.case
    sizes = replace(case.gear.geometry, radius=np.nan)
    spring = replace(
        rubbing, case=replace(case, gear=replace(case.gear, geometry=sizes))
    )
    with pytest.raises(InputError, match="400 mm, where the readings reach"):
        predict(spring, [400.0])


def test_a_failed_posterior_predicts_nothing(rubbing):
    failed = replace(rubbing, checks=(Check("made to fail", "failed", "on purpose"),))
    with pytest.raises(NotUsable, match="made to fail"):
        predict(failed, [0.1])
    assert not default_bands(failed).usable.any()


@pytest.mark.thorough
def test_the_gap_widens_the_bands_beyond_the_data_and_leaves_stiffness_alone():
    deformation = np.linspace(0.02, 0.54, 60)
    bent = 205.0 * deformation + 60.0 * (deformation - 0.02) * (deformation - 0.54)
    force = bent + np.random.default_rng(1).normal(0.0, 0.3, 60)
    case = make_case(make_records(deformation, force, known={"temperature"}))
    gap = calibrate(case, with_gap=True, **SHORT)
    found = predict(gap, [0.28, 0.60])
    inside, outside = found.with_gap_hi_N - found.with_gap_lo_N
    assert outside > 2.0 * inside
    assert (
        found.with_gap_lo_N[0]
        < np.interp(0.28, deformation, bent)
        < (found.with_gap_hi_N[0])
    )
    # Orthogonal to the base: the slope stays where least squares put it.
    (slope, _), covariance = np.polyfit(deformation, force, 1, cov=True)
    assert abs(np.median(gap.draws["stiffness"]) - slope) < np.sqrt(covariance[0, 0])


@pytest.mark.thorough
def test_the_gap_is_the_same_at_every_temperature():
    """Tested at one temperature away from the reference, it must not tilt at others."""
    deformation = np.linspace(0.02, 0.54, 60)
    force = 205.0 * deformation + 60.0 * (deformation - 0.02) * (deformation - 0.54)
    force = force + np.random.default_rng(1).normal(0.0, 0.3, 60)
    warm = np.full(60, 60.06)
    records = make_records(deformation, force, temperature=warm, known={"temperature"})
    # So few draws do not always settle how long the leftover's waves are.
    size = SHORT | {"draws": 2 * SHORT["draws"]}
    posterior = calibrate(make_case(records), with_gap=True, **size)
    found = predict(posterior, [0.1, 0.28, 0.5], [60.06, 20.0, 100.0])
    leftover = (found.with_gap_median_N - found.physics_median_N).reshape(3, 3)
    assert leftover[1] == pytest.approx(leftover[0], abs=0.2)
    assert leftover[2] == pytest.approx(leftover[0], abs=0.2)
    assert abs(leftover[0, 1]) > 1.0
    # The grid of the folder keeps the tested temperature itself, not a rounded one.
    assert default_bands(posterior).tested.any()


def test_a_new_run_and_specimen_are_less_certain_than_the_tested():
    posterior = batch()
    alike = {
        name: 0.0 * posterior.draws[name] for name in ("run_offset_sd", "specimen_sd")
    }

    def width(*scatter: str) -> float:
        still = {name: none for name, none in alike.items() if name not in scatter}
        draws = posterior.draws | still
        found = predict(written_posterior(posterior.case, draws), [0.3])
        return (found.new_measurement_hi_N - found.new_measurement_lo_N)[0]

    of_run, of_gear = (
        np.sqrt(width(name) ** 2 - width() ** 2) / (2.0 * 1.96) for name in alike
    )
    # Six runs tell their mean too: a newton of scatter, and a sixth of its variance.
    assert of_run == pytest.approx(np.sqrt(7.0 / 6.0), rel=0.1)
    assert of_gear > 0.05 * 205.0 * 0.3
    both = width("run_offset_sd", "specimen_sd")
    assert both > max(width("run_offset_sd"), width("specimen_sd"))
