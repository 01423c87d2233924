"""What readings show is said in words, with its size, and never of pure noise."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from rigs import cycles, make_case, make_gear, make_records, ramp

from hdcal.data.loading import derive_motion
from hdcal.data.priors import effect_priors, rig_priors
from hdcal.diagnosis.seen import what_is_seen
from hdcal.evidence.compute_evidence import compute_evidence

# No effects: they are not what is asked for, and cost time.
LIBRARY = {}


def seen(case):
    return what_is_seen(compute_evidence(case, LIBRARY, effect_priors()), case)


CASES = {
    "coulomb_friction": ({"force": 3.0}, "on unloading than on loading", 6.0),
    "load_friction": ({"share": 0.05}, "the lower unloading lies against", None),
    "progressive_stiffening": ({"slope": 0.3}, "the curve stiffens", None),
    "thermal_zero_drift": ({"slope": 0.1}, "the zero rises with temperature", 6.0),
    "thermal_stiffness": ({"slope": -2e-3}, "the slope falls with temperature", None),
    "viscous_damping": ({"coefficient": 60.0}, "takes more force", None),
    "stiffness_fatigue": ({"loss": 0.05}, "the slope falls from cycle to cycle", None),
}


@pytest.mark.parametrize("name", CASES)
def test_what_an_effect_does_is_seen_first(name):
    values, words, size = CASES[name]
    first, *_ = seen(simulated(rich(), {name: values}, seed=2))
    assert words in first.statement
    assert first.material
    assert first.p_value < 1e-3
    if size is not None:
        assert first.size_N.lo < size < first.size_N.hi
        assert f"{size:.0f} N" in first.statement


def test_a_loop_that_opens_with_the_load_is_no_slope_that_falls_from_cycle_to_cycle():
    found = seen(simulated(rich(), {"load_friction": {"share": 0.05}}, seed=2))
    assert [one.covariate for one in found] == ["direction"]


def test_an_angle_that_was_not_measured_shows_nothing():
    """Its column is that of the slope, but for rounding, however sure the rest is."""
    case = simulated(rich(), {"thermal_stiffness": {"slope": -1.4e-2}}, seed=2)
    assert "angle" not in {one.covariate for one in seen(case)}


def test_a_slope_that_falls_with_heat_is_told_of_a_part_of_no_stated_material():
    effect = {"thermal_stiffness": {"slope": -5e-3}}
    loose = make_gear(alpha=rig_priors()["spring_alpha"])
    case = replace(simulated(rich(), effect, seed=2), gear=loose)
    (first, *_) = seen(case)
    assert "the slope falls with temperature, which" in first.statement
    (first, *_) = seen(simulated(rich(), effect, seed=2))
    assert "with temperature beyond the material's own" in first.statement


def test_of_pure_noise_nothing_is_seen():
    """Family-wise 1 %: of 30 rigs three or more would show something once in 300."""
    found = [
        bool(seen(simulated(rich(), seed=seed, correlation=0.3 * (seed % 2))))
        for seed in range(30)
    ]
    assert sum(found) <= 2


def test_the_sizes_hold():
    """Simultaneous 95 % intervals; of 24 rigs 19 or fewer would hold once in 160."""
    hold = 0
    for seed in range(24):
        case = simulated(rich(), {"coulomb_friction": {"force": 1.0}}, seed=seed)
        size = seen(case)[0].size_N
        hold += size.lo < 2.0 < size.hi
    assert hold >= 20


def test_a_step_between_runs_and_a_gear_of_its_own_are_told_by_their_labels():
    records = cycles(48)
    run = np.repeat([0, 1, 2], 16)
    steps = np.array([0.0, 0.0, 5.0])[run] + 0.1 * np.sin(np.arange(48.0) * 7.0)
    force = 195.0 * records.deformation + steps
    case = make_case(replace(records, force=force, run=run))
    case = replace(case, run_labels=("A", "B", "{size} <b>"))
    assert "from run B to {size} <b>" in seen(case)[0].statement.replace(
        "5 N", "{size}"
    )
    force = 195.0 * records.deformation * (1.0 + 0.05 * (run == 1))
    noise = 0.1 * np.sin(np.arange(48.0) * 7.0)
    case = make_case(replace(records, force=force + noise, specimen=run))
    assert "gear 1 is stiffer" in seen(case)[0].statement


def test_a_gear_that_is_pulled_is_told_by_the_size_of_its_force():
    case = simulated(rich(), {"coulomb_friction": {"force": 3.0}}, seed=2)
    r = case.records
    turned = {n: -np.asarray(getattr(r, n)) for n in ("deformation", "force", "sense")}
    turned |= {"direction": -r.direction, "rate": -r.rate}
    pulled = replace(case, records=replace(r, **turned))
    first, second = seen(case)[0], seen(pulled)[0]
    assert "lower on unloading" in first.statement
    assert "lower on unloading" in second.statement


def test_through_zero_nothing_is_called_unloading():
    case = simulated(rich(), {"coulomb_friction": {"force": 3.0}}, seed=2)
    w = np.asarray(case.records.deformation)
    shift = 0.27
    force = np.asarray(case.records.force) - 195.0 * shift
    moved = replace(case.records, deformation=w - shift, force=force)
    assert "decreases than while" in seen(replace(case, records=moved))[0].statement


def test_of_one_speed_there_and_back_only_the_direction_is_told():
    records = cycles(48)
    sense = np.asarray(records.sense, float)
    # Friction builds up at a reversal, where the rate over the turn is less too.
    rate = 0.01 * sense * np.where(np.diff(sense, prepend=0.0) == 0.0, 1.0, 0.3)
    noise = 0.1 * np.sin(np.arange(48.0) * 7.0)
    force = 195.0 * records.deformation + 300.0 * rate + noise
    known = records.known - {"rates"}
    one = make_case(replace(records, force=force, rate=rate, known=known))
    assert "lower on unloading" in seen(one)[0].statement
    both = replace(one.records, known=known | {"rates"})
    assert "faster movement" in seen(replace(one, records=both))[0].statement


@pytest.mark.thorough
def test_few_rows_alarm_as_seldom():
    """Of 200 ramps of six rows, 1 % due: seven or more would come once in 200."""
    alarms = [bool(seen(simulated(ramp(6), seed=seed))) for seed in range(200)]
    assert sum(alarms) < 7


def test_one_mounting_that_is_off_is_told():
    records = simulated(cycles(48), seed=3).records
    run = np.repeat([0, 1, 2], 16)
    force = np.asarray(records.force) + 4.0 * (run == 1)
    (first, *_) = seen(make_case(replace(records, force=force, run=run)))
    assert "the zero of run 1 lies" in first.statement
    assert "higher than that of the others" in first.statement


def test_a_toe_is_told_whether_or_not_it_begins_at_zero():
    for start in (0.0, 1e-6):
        w = np.linspace(start, 0.54, 40)
        force = 195.0 * w + np.where(np.arange(40) < 4, 3.0, 0.0)
        noise = 0.3 * np.random.default_rng(1).normal(size=40)
        (first, *_) = seen(make_case(make_records(w, force + noise)))
        assert "at small deformations" in first.statement
        assert first.size_N.median < 8.0


def test_a_place_that_is_read_twice_was_not_held():
    there = np.linspace(0.02, 0.54, 48)
    x = np.concatenate([there, there[::-1]] * 2)
    side = np.tile(np.repeat([1.0, -1.0], 48), 2)
    force = 205.0 * x + 3.0 * side
    force += np.random.default_rng(4).normal(0.0, 0.3, len(x))
    time = np.arange(float(len(x)))
    motion = derive_motion(x, np.zeros(len(x), int), time)
    assert (
        np.count_nonzero(motion.direction == 0.0) > 0 and "holds" not in motion.features
    )
    moved = {name: getattr(motion, name) for name in ("direction", "sense", "rate")}
    known = motion.features | {"time"}
    found = seen(make_case(make_records(x, force, time=time, known=known, **moved)))
    assert "on unloading than on loading" in found[0].statement
    assert not any("is held" in one.statement for one in found)


@pytest.mark.parametrize("stroke", [0.0045, 0.45, 45.0])
def test_a_loop_that_changes_over_gradually_has_its_whole_width_and_is_told_once(
    stroke,
):
    """Joints that stick over a fortieth of the range, in rows as dense as a log's."""
    up = np.linspace(0.0, stroke, 67)
    path = np.concatenate([up, up[-2::-1], up[1:], up[-2::-1]])
    stuck, loop = 0.0, []
    for step in np.diff(path, prepend=0.0):
        stuck = np.clip(stuck + 90.0 * step / stroke, -2.4, 2.4)
        loop.append(stuck)
    force = 50.0 * path / stroke + loop
    force += np.random.default_rng(3).normal(0.0, 0.3, len(path))
    motion = derive_motion(path, np.zeros(len(path), int))
    moved = {name: getattr(motion, name) for name in ("direction", "sense", "rate")}
    case = make_case(make_records(path, force, known=motion.features, **moved))
    told = [one for one in seen(case) if one.covariate == "direction"]
    (one,) = told
    assert one.size_N.lo < 4.8 < one.size_N.hi and one.size_N.hi < 6.0


@pytest.mark.parametrize("seed", [2, 4, 5])
def test_a_loop_beside_zeros_of_mountings_has_its_width(seed):
    """Zeros that differ pass for noise that errs alike, of which a loop is a part.

    Of a loop of 2 N, less what a slope takes up, 0.7 to 0.9 N would be said.
    """
    rng = np.random.default_rng(seed)
    up = np.linspace(0.0, 0.45, 30)
    one = np.concatenate([up, up[-2::-1]])
    stuck, loop = 0.0, []
    for step in np.diff(one, prepend=0.0):
        stuck += (np.sign(step) - stuck) * (1.0 - np.exp(-abs(step) / 0.05))
        loop.append(stuck)
    path, run = np.tile(one, 4), np.repeat(np.arange(4), len(one))
    force = 108.0 * path + np.tile(loop, 4) + 0.8 * rng.normal(size=4)[run]
    noise = rng.normal(size=len(path))
    for row in range(1, len(noise)):
        noise[row] = 0.7 * noise[row - 1] + np.sqrt(0.51) * noise[row]
    motion = derive_motion(path, run)
    moved = {name: getattr(motion, name) for name in ("direction", "sense", "rate")}
    known = motion.features | {"run"}
    records = make_records(path, force + 0.25 * noise, run=run, known=known, **moved)
    told = [one for one in seen(make_case(records)) if one.covariate == "direction"]
    assert 1.5 < told[0].size_N.median < 2.1


def runs_with_zeros(*zeros: float, seed: int):
    """Return a straight line in runs; the noise is the same with every JAX."""
    records = simulated(cycles(48), seed=3).records
    run = np.repeat([0, 1, 2], 16)
    noise = 0.5 * np.random.default_rng(seed).standard_normal(48)
    force = 200.0 * np.asarray(records.deformation) + np.array(zeros)[run] + noise
    case = make_case(replace(records, force=force, run=run))
    return replace(case, run_labels=("A", "{size}", "C"))


def test_zeros_that_all_differ_are_told_as_one():
    case = runs_with_zeros(4.0, -6.0, 2.0, seed=6)
    (only,) = [each for each in seen(case) if each.covariate == "run"]
    assert "run {size} the lowest, run A the highest" in only.statement
    assert only.size_N.lo < 10.0 < only.size_N.hi
    assert only.material


def test_a_label_with_braces_stays_as_it_is():
    case = runs_with_zeros(0.0, -9.0, 0.0, seed=0)
    (only,) = [each for each in seen(case) if each.covariate == "run"]
    assert only.statement.startswith("the zero of run {size} lies ")
