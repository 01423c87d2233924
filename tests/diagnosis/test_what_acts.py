"""Planted effects are said to act, lookalikes share a class, nothing else is said."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from rigs import make_records

import hdcal
from hdcal.data.case import Case
from hdcal.diagnosis.decision import Decision, decide
from hdcal.diagnosis.which import Cause
from hdcal.physics.registry import EFFECTS

PLANTED = {
    "hysteresis": {"force": 4.0, "reach": 0.1},
    "amplifier_drift": {"rate": 0.02},
    "progressive_stiffening": {"slope": 0.4},
}
YIELD = {"plastic_yield": {"softening": 0.2, "yield_deformation": 0.35}}


def class_of(found: Decision, name: str) -> Cause:
    return next(each for each in found.which.causes if name in each.members)


def with_wild_readings(case: Case, count: int = 9) -> Case:
    rng = np.random.default_rng(3)
    force = np.array(case.records.force)
    wild = rng.choice(len(force), count, replace=False)
    force[wild] += rng.choice([-1.0, 1.0], count) * rng.uniform(3.0, 8.0, count)
    return replace(case, records=replace(case.records, force=force))


@pytest.fixture(scope="module", params=PLANTED)
def planted(request) -> tuple[str, Decision]:
    name = request.param
    case = simulated(rich(), {name: PLANTED[name]}, seed=1)
    return name, decide(case, EFFECTS)


def test_planted_effect_acts(planted):
    name, found = planted
    assert found.which.effect == name
    cause = class_of(found, name)
    assert cause.probability >= 0.9 and cause in found.which.acting and found.which.fits
    assert cause.explains is not None and cause.explains.median > 0.9
    assert found.which.explanations[0].effects == (name,)


def test_probabilities_add_up(planted):
    _, found = planted
    whole = sum(each.probability for each in found.explanations)
    assert whole == pytest.approx(1.0, abs=1e-9)
    assert sum(found.hypotheses.values()) == pytest.approx(1.0, abs=1e-9)
    held = [each.probability for each in found.which.explanations]
    assert sum(held) >= 0.9 > sum(held[:-1])
    members = [name for each in found.which.causes for name in each.members]
    assert len(members) == len({*members})


def test_plain_case_has_no_gap():
    chances = [decide(simulated(rich(), seed=seed), EFFECTS).gap for seed in range(4)]
    assert max(chances) < 0.5 and np.mean(chances) < 0.2


def test_wild_readings_are_outliers():
    found = decide(with_wild_readings(simulated(rich(), seed=2)), EFFECTS)
    assert found.which.inclusion["outliers"] > 0.9
    assert found.which.outside.probability < 0.1
    assert found.which.explanations[0].effects == ("outliers",)


def test_wild_readings_stand_beside_structure():
    case = simulated(rich(), {"hysteresis": PLANTED["hysteresis"]}, seed=2)
    found = decide(with_wild_readings(case), EFFECTS)
    assert found.which.inclusion["hysteresis"] > 0.9
    assert found.which.inclusion["outliers"] > 0.9
    assert found.which.explanations[0].effects == ("hysteresis", "outliers")


def test_readings_that_agree_with_their_neighbours_are_no_outliers():
    case = simulated(rich(), seed=5)
    force = np.array(case.records.force)
    force[70:100] += 3.0
    case = replace(case, records=replace(case.records, force=force))
    found = decide(case, EFFECTS)
    assert found.which.inclusion["outliers"] < 0.1 and found.gap > 0.99
    assert found.which.outside.probability > 0.9


def test_ramp_does_not_separate_yield_from_saturation():
    ramp = make_records(np.linspace(0.02, 0.54, 120))
    found = decide(simulated(ramp, YIELD, seed=1), EFFECTS)
    cause = class_of(found, "plastic_yield")
    assert cause.probability > 0.9 and "force_saturation" in cause.members
    # A cycle does: the class is another one.
    cycled = decide(simulated(rich(), YIELD, seed=1), EFFECTS)
    assert "force_saturation" not in class_of(cycled, "plastic_yield").members


@pytest.mark.parametrize("name", ["amplifier_drift", "coulomb_friction"])
def test_withheld_effect_is_outside(name):
    size = {"amplifier_drift": {"rate": 0.02}, "coulomb_friction": {"force": 2.0}}
    library = {n: effect for n, effect in EFFECTS.items() if n != name}
    found = decide(simulated(rich(), {name: size[name]}, seed=1), library)
    assert found.gap > 0.99 and found.explanations[0].outside
    assert not [each for each in found.which.causes if each.probability >= 0.9]


def test_effect_beside_a_wave_has_its_share():
    case = simulated(rich(), {"hysteresis": PLANTED["hysteresis"]}, seed=1)
    place = np.asarray(case.records.deformation) / 0.54
    wave = 1.2 * np.sin(2.0 * np.pi * 4.0 * place**2.5)
    force = np.asarray(case.records.force) + wave
    found = decide(replace(case, records=replace(case.records, force=force)), EFFECTS)
    cause = class_of(found, "hysteresis")
    assert cause.probability > 0.9 and found.which.outside.probability > 0.9
    assert cause.explains is not None and 0.3 < cause.explains.median < 0.9


def test_effects_without_their_column_predict_nothing():
    found = decide(simulated(make_records(np.linspace(0.02, 0.54, 60))), EFFECTS)
    assert found.which.not_testable["thermal_stiffness"] == ("temperature",)
    assert found.which.not_testable["ovality"] == ("angle",)
    assert not found.which.not_testable.keys() & found.which.inclusion.keys()


def read(scale: float = 1.0, origin: float = 0.0) -> Decision:
    """Return the decision on a spring whose force is read in other units."""
    case = simulated(rich(), {"hysteresis": PLANTED["hysteresis"]}, seed=1)
    table = case.to_frame()
    table["force_N"] = scale * (table["force_N"] + origin)
    return decide(hdcal.read_case(table), EFFECTS)


@pytest.mark.parametrize(("scale", "origin"), [(1000.0, 0.0), (1.0, 40.0)])
def test_scale_and_origin_of_the_force_change_little(scale, origin):
    plain, other = read(), read(scale, origin)
    assert other.which.inclusion["hysteresis"] > 0.9
    for name, chance in plain.which.inclusion.items():
        assert other.which.inclusion[name] == pytest.approx(chance, abs=0.05)
    ends = [each.gap_N for each in (plain, other)]
    assert ends[0] is not None and ends[1] is not None
    assert ends[1].median / scale == pytest.approx(ends[0].median, rel=0.02)


def test_coarse_reading_is_a_fact_and_no_gap():
    case = simulated(rich(), seed=6)
    force = 1.5 * np.round(np.asarray(case.records.force) / 1.5)
    found = decide(replace(case, records=replace(case.records, force=force)), EFFECTS)
    assert found.coarse_step == pytest.approx(1.5)
    assert found.gap < 0.5 and "quantisation" not in found.which.inclusion
