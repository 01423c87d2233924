"""Planted effects act, lookalikes share a class, and nothing else acts."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from rigs import make_records

from hdcal.data.case import Case
from hdcal.diagnosis import decision
from hdcal.diagnosis.acting import Acting, acts_in
from hdcal.diagnosis.decision import Decision
from hdcal.diagnosis.gap import Fitted, nearest_effects
from hdcal.diagnosis.which import Cause, Which
from hdcal.evidence.linear_problem import linear_problem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.search import search
from hdcal.physics.registry import EFFECTS
from hdcal.report.item import Interval

HYSTERESIS = {"hysteresis": {"force": 4.0, "reach": 0.1}}
PLANTED = {
    **HYSTERESIS,
    "amplifier_drift": {"rate": 0.02},
    "progressive_stiffening": {"slope": 0.4},
}


def decide(case: Case, library=EFFECTS) -> Decision:
    return decision.decide(search(case, library))


def class_of(found: Decision, name: str) -> Cause:
    return next(each for each in found.which.causes if name in each.members)


def with_force(case: Case, force) -> Case:
    return replace(case, records=replace(case.records, force=np.asarray(force)))


def with_wild_readings(case: Case, count: int = 9) -> Case:
    rng = np.random.default_rng(3)
    force = np.array(case.records.force)
    wild = rng.choice(len(force), count, replace=False)
    force[wild] += rng.choice([-1.0, 1.0], count) * rng.uniform(3.0, 8.0, count)
    return with_force(case, force)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_effect_acts_and_probabilities_add_up(name: str):
    found = decide(simulated(rich(), {name: PLANTED[name]}, seed=1))
    assert found.which.effect == name
    cause = class_of(found, name)
    assert cause.probability >= 0.9 and cause in found.which.acting and found.which.fits
    assert cause.explains is not None and cause.explains.median > 0.9
    assert found.which.explanations[0].effects == (name,)
    whole = sum(each.probability for each in found.explanations)
    assert whole == pytest.approx(1.0, abs=1e-9)
    assert sum(found.hypotheses.values()) == pytest.approx(1.0, abs=1e-9)
    held = [each.probability for each in found.which.explanations]
    assert sum(held) >= 0.9 > sum(held[:-1])
    members = [name for each in found.which.causes for name in each.members]
    assert len(members) == len({*members})


@pytest.mark.parametrize("effects", [{}, HYSTERESIS])
def test_wild_readings_are_outliers_with_or_without_structure(effects: dict):
    found = decide(with_wild_readings(simulated(rich(), effects, seed=2)))
    assert found.which.inclusion["outliers"] > 0.9
    assert found.which.outside.probability < 0.1
    assert found.which.explanations[0].effects == (*effects, "outliers")


@pytest.mark.parametrize("where", ["stretch", "burst", "place"])
def test_wild_readings_that_agree_with_neighbours_are_structure(where: str):
    """On one side, neighbours in time or in the deformation; a burst is noise."""
    case = simulated(rich(), seed=5)
    force, records = np.array(case.records.force), case.records
    place, loading = np.asarray(records.deformation), np.asarray(records.sense) > 0
    if where == "stretch":
        force[70:100] += 3.0
    elif where == "burst":
        force[70:82] += 6.0 * (-1.0) ** np.arange(12)
    else:
        force[loading & (np.abs(place - 0.3) < 0.02)] += 4.0
    found = decide(with_force(case, force))
    inclusion, outside = found.which.inclusion, found.which.outside.probability
    assert found.gap > 0.99
    if where == "burst":
        assert inclusion["outliers"] > 0.9 and outside < 0.1
        assert inclusion["heteroscedastic_noise"] < 0.1
    else:
        assert inclusion["outliers"] < 0.1 and outside > 0.9


@pytest.mark.parametrize(
    ("softening", "path", "alike"),
    [(0.1, "ramp", True), (0.2, "cycles", False), (0.2, "ramp", False)],
)
def test_loading_or_shape_separates_yield_from_saturation(softening, path, alike):
    """A large kink is no smooth saturation, even where nothing was unloaded."""
    records = rich() if path == "cycles" else make_records(np.linspace(0.02, 0.54, 120))
    size = {"softening": softening, "yield_deformation": 0.35}
    found = decide(simulated(records, {"plastic_yield": size}, seed=1))
    cause = class_of(found, "plastic_yield")
    assert cause.probability > 0.9
    assert ("force_saturation" in cause.members) == alike
    excluded = found.which.inclusion["force_saturation"] < 0.01
    assert excluded != alike


def test_without_unloading_a_loop_and_a_yield_are_one_class():
    """A bar that yields at a twelfth of its extension; its curve alone is no loop."""
    case = simulated(make_records(np.linspace(0.0, 0.6, 120)), seed=1)
    x, noise = np.asarray(case.records.deformation), np.random.default_rng(1)
    force = 400.0 * np.minimum(x, 0.05) + 2.0 * x + noise.normal(0.0, 0.1, 120)
    cause = class_of(decide(with_force(case, force)), "plastic_yield")
    assert cause.probability > 0.9 and {"hysteresis", "plastic_yield"} <= {
        *cause.members
    }


def test_a_bend_upwards_is_in_no_class_with_one_downwards():
    records = make_records(np.linspace(0.02, 0.54, 40))
    bend = {"progressive_stiffening": {"slope": 1.0}}
    found = decide(simulated(records, bend, seed=1))
    members = class_of(found, "progressive_stiffening").members
    assert "displacement_nonlinearity" in members
    assert not {"force_saturation", "seating_slack"} & {*members}


def test_a_ramp_has_no_loop():
    """Of a loop that widens it shows the few readings below zero, of any size."""
    case = simulated(make_records(np.linspace(-0.01, 0.54, 150)), seed=4)
    force = np.array(case.records.force)
    force[:3] -= 4.0
    found = judged(with_force(case, force))
    assert not [seen for seen in found.seen if seen.covariate == "direction"]


@pytest.mark.parametrize(
    ("correlation", "beside", "acts"),
    [(0.0, 0.0, True), (0.9, 0.0, False), (0.0, 5.0, True), (0.0, 30.0, False)],
)
def test_a_component_acts_where_rows_show_it_and_it_closes_something(
    correlation: float, beside: float, acts: bool
):
    """Correlated noise hides slow curves; of a large gap a small one closes nothing."""
    case = simulated(rich(), seed=1)
    problem = linear_problem(case, {}, noise_sd=0.5)
    rows = np.linspace(0.0, 1.0, len(problem.y))
    slow, fast = np.sin(2.0 * np.pi * rows), np.sin(40.0 * np.pi * rows)
    # Its squared length is 30 noise variances.
    slow *= 0.5 * np.sqrt(30.0) / np.linalg.norm(slow)
    fast *= beside * np.linalg.norm(slow) / np.linalg.norm(fast)
    noise = NoiseModel("", np.ones(len(rows)), correlation, 0.0)
    curves = np.stack([slow, fast])[:, None]
    found = acts_in(problem, noise, curves, least=1e-3)
    assert found[:, 0].tolist() == [acts, beside > 0.0]


def test_a_withheld_effect_is_outside():
    library = {n: effect for n, effect in EFFECTS.items() if n != "amplifier_drift"}
    drift = {"amplifier_drift": {"rate": 0.02}}
    found = decide(simulated(rich(), drift, seed=1), library)
    assert found.gap > 0.99 and found.explanations[0].outside
    assert not [each for each in found.which.causes if each.probability >= 0.9]


@pytest.mark.parametrize(
    ("chance", "share", "outside", "mostly"),
    [
        (0.9, 0.3, 0.4, True),
        (0.9, 0.5, 0.4, False),
        (0.4, 0.3, 0.4, False),
        (0.9, None, 0.4, True),
    ],
)
def test_most_is_outside_where_no_effect_that_acts_explains_more(
    chance: float, share: float | None, outside: float, mostly: bool
):
    def cause(members, probability, middle):
        share = Interval(median=middle, lo=0.0, hi=1.0)
        return Cause(members=members, probability=probability, explains=share)

    which = Which.model_construct(
        causes=() if share is None else (cause(("hysteresis",), 0.8, share),),
        outside=cause((), chance, outside),
    )
    assert which.mostly_outside == mostly


def test_the_nearest_effects_explain_what_least_squares_with_them_does():
    planted = {"amplifier_drift": {"rate": 0.02}}
    case, records = simulated(rich(), planted, seed=1), rich()
    x, time = np.asarray(records.deformation), np.asarray(records.time)
    wave = 3.0 * np.sin(2.0 * np.pi * 4.0 * (x / 0.54) ** 2.5)
    case = with_force(case, case.records.force + wave)
    library = {name: EFFECTS[name] for name in (*PLANTED, "viscous_damping")}
    searched = search(case, library)
    noise = NoiseModel("", np.ones(len(x)), 0.0, 0.0)
    names, share = nearest_effects(searched, Fitted(noise, 0.0, {}))
    left = []
    for columns in ([], [time]):
        design = np.stack([np.ones_like(x), x, *columns], axis=1)
        fit = np.linalg.lstsq(design, np.asarray(case.records.force), rcond=None)
        left.append(float(fit[1][0]))
    assert names == ("amplifier_drift",)
    assert share == pytest.approx(1.0 - np.sqrt(left[1] / left[0]), abs=0.02)


def test_an_effect_beside_a_wave_has_its_share():
    case = simulated(rich(), HYSTERESIS, seed=1)
    place = np.asarray(case.records.deformation) / 0.54
    wave = 1.2 * np.sin(2.0 * np.pi * 4.0 * place**2.5)
    found = decide(with_force(case, case.records.force + wave))
    cause = class_of(found, "hysteresis")
    assert cause.probability > 0.9 and found.which.outside.probability > 0.9
    assert cause.explains is not None and 0.3 < cause.explains.median < 0.9


def test_effects_without_their_column_are_not_tested():
    which = decide(simulated(make_records(np.linspace(0.02, 0.54, 60)))).which
    assert which.not_testable["thermal_stiffness"] == ("temperature",)
    assert which.not_testable["ovality"] == ("angle",)
    assert not which.not_testable.keys() & which.inclusion.keys()


def test_effects_that_carry_little_beside_something_outside_are_not_calibrated():
    """In three of ten draws friction closes half of the gap."""
    carried = np.array([0.1] * 7 + [0.9] * 3)
    both = ("coulomb_friction", "outside")
    found = Acting(0.2, both, "outliers", {}, carried, np.ones(10))
    alone, whole = ("outliers", "outside"), ("coulomb_friction", "outliers", "outside")
    assert found.hypotheses() == pytest.approx({alone: 0.7, whole: 0.3})
    explained = {("outside",): 0.7, ("coulomb_friction", "outliers"): 0.3}
    assert found.explanations() == pytest.approx(explained)
    single = replace(found, components=("coulomb_friction",), noise="")
    assert single.hypotheses() == {("coulomb_friction",): 1.0}
    assert single.explanations() == single.hypotheses()
    assert replace(found, components=()).explanations() == {("outliers",): 1.0}
