"""A diagnosis names what is there, and says so when it cannot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from rigs import cycles, make_case, make_gear, make_records, ramp
from slices import slice_of

import hdcal
from hdcal.data.prior import Prior
from hdcal.diagnosis.model_posterior import NAMED
from hdcal.diagnosis.verdict import Verdict
from hdcal.physics.effect import Effect, parameter
from hdcal.physics.registry import EFFECTS

DATASETS = Path(__file__).parents[2] / "datasets"
CURVATURE = {
    name
    for name, effect in EFFECTS.items()
    if {"curve up", "curve down"} & {*effect.groups}
}
# Amplitudes for a visible gap of about twice the noise.
LARGE = {
    "coulomb_friction": {"force": 0.8},
    "hysteresis": {"force": 1.2, "reach": 0.1},
    "viscous_damping": {"coefficient": 50.0},
    "thermal_zero_drift": {"slope": 0.08},
    "progressive_stiffening": {"slope": 0.15},
    "relaxation": {"share": 0.03, "time_constant": 30.0},
    "stiffness_fatigue": {"loss": 0.01},
}
LEFT_OUT = frozenset({"thermal_zero_drift", "thermal_expansion"})


class Stick(Effect, stage="force", groups=("curve up",)):
    """A user's own effect: a step of the force at half the range."""

    force: float = parameter("N", "height of the step", typical=2.0, null=0.0)

    def apply(self, signal, rows):
        return signal + self.force * (rows.deformation > 0.27)


@pytest.fixture(scope="session")
def friction() -> Verdict:
    return judged(simulated(rich(), {"coulomb_friction": LARGE["coulomb_friction"]}))


@pytest.fixture(scope="session")
def article() -> Verdict:
    return judged(hdcal.read_case(DATASETS / "xb1-100-80"))


def assert_consistent(verdict: Verdict):
    """Probabilities sum to one, and the set is the smallest that holds 90 %."""
    share = verdict.which.probabilities
    assert sum(share.values()) == pytest.approx(1.0)
    for effect, chance in verdict.which.inclusion.items():
        both = sum(p for name, p in share.items() if effect in name.split("+"))
        assert chance == pytest.approx(both)
    ranked, total, found = sorted(share, key=lambda n: -share[n]), 0.0, set()
    for name in ranked:
        # A remainder is no cause of its own.
        found |= {name} if name == "unknown" else {*name.split("+")} - {"unknown"}
        total += share[name]
        if total >= NAMED:
            break
    expected = {"none"} if verdict.which.verdict == "none" else found
    assert set(verdict.which.set) == expected
    assert (verdict.which.verdict == "named") <= bool(verdict.which.effect)


def test_friction_alone_describes_its_loop(friction):
    """Other causes get its name too often for one, so that its group is said."""
    assert friction.which.verdict == "group" and friction.which.group == "loop"
    assert friction.which.describes_best
    assert friction.which.effect == "coulomb_friction"
    assert friction.gap.detected and friction.where.p_value <= 0.05
    size = friction.which.amplitude
    assert size is not None and size.lo < 0.8 < size.hi
    assert friction.shrink.closed is not None and friction.shrink.closed.median > 0.8
    assert friction.status == "ok"
    assert_consistent(friction)


@pytest.mark.parametrize("name", slice_of(LARGE, ["hysteresis"]))
def test_a_large_effect_is_named(name):
    verdict = judged(simulated(rich(), {name: LARGE[name]}, seed=3))
    allowed = LEFT_OUT if name in LEFT_OUT else {name}
    assert verdict.which.effect in allowed, verdict.which.set
    assert_consistent(verdict)


@pytest.mark.thorough
def test_two_effects_are_both_included():
    both = {
        "hysteresis": {"force": 0.6, "reach": 0.1},
        "thermal_zero_drift": {"slope": 0.05},
    }
    share = judged(simulated(rich(), both, seed=5)).which.inclusion
    # The zero of the force and that of the deformation drift alike.
    zero = sum(share.get(name, 0.0) for name in LEFT_OUT)
    assert share["hysteresis"] > 0.5 and zero > 0.5, share


@pytest.mark.parametrize("correlation", [0.0, 0.5])
@pytest.mark.parametrize("seed", slice_of([0, 1], [1]))
def test_noise_has_no_cause(seed, correlation):
    case = simulated(rich(), seed=20 + seed, correlation=correlation)
    verdict = judged(case)
    assert verdict.which.verdict == "none"
    assert verdict.which.effect is None and verdict.which.amplitude is None
    assert verdict.shrink.closed is None and verdict.shrink.reason
    assert_consistent(verdict)


def test_fourteen_rows_of_noise_have_no_cause(article):
    verdict = judged(simulated(ramp(14), seed=2))
    assert verdict.which.verdict == "none"
    assert_consistent(verdict)


def test_heavy_tails_name_no_effect_on_the_mean():
    for seed in (0, 1):
        which = judged(simulated(rich(), seed=seed, freedom=4.0)).which
        noisy = {n for n, e in EFFECTS.items() if e.stage == "noise"}
        assert which.verdict != "named" or which.effect in noisy, which.set


def test_the_article_s_gap_has_several_possible_causes(article):
    which, shrink = article.which, article.shrink
    assert article.gap.detected
    assert which.verdict == "ambiguous"
    assert len(CURVATURE & set(which.set)) >= 2
    assert max(which.inclusion.values()) < NAMED
    assert shrink.closed is not None
    assert shrink.closed.lo <= shrink.closed.median <= shrink.closed.hi
    assert article.next_test
    assert_consistent(article)
    # The gear file says that its scale steps by 0.1 kgf.
    assert "quantisation" not in which.probabilities


def test_what_was_not_measured_is_not_tested(article):
    not_testable = {one.effect: one.needs for one in article.which.not_testable}
    assert not_testable["coulomb_friction"] == ("unloading",)
    assert not_testable["thermal_zero_drift"] == ("temperature",)
    assert not set(not_testable) & set(article.which.inclusion)


def test_the_same_seed_gives_the_same_verdict(article):
    again = judged(hdcal.read_case(DATASETS / "xb1-100-80"))
    assert again.which.probabilities == article.which.probabilities
    assert again.where.p_value == article.where.p_value
    assert again.shrink == article.shrink
    assert again.next_test == article.next_test
    np.testing.assert_array_equal(again.where.gap_N, article.where.gap_N)


@pytest.mark.thorough
def test_a_library_with_one_effect_less_and_a_user_s_own_one_more(friction):
    """What is left out is never named; what is added is, on data of its own."""
    library = {n: e for n, e in EFFECTS.items() if n != "coulomb_friction"}
    library |= {"stick": Stick}
    prior = {"stick.force": Prior("half_normal", (2.0,))}
    gear = replace(make_gear(), effect_priors=prior)
    verdict = judged(replace(friction.case, gear=gear), library=library)
    assert "coulomb_friction" not in "+".join(verdict.which.probabilities).split("+")
    assert verdict.library == tuple(library)
    case = simulated(rich(), {"stick": {"force": 1.6}}, library=library)
    verdict = judged(replace(case, gear=gear), library=library)
    assert verdict.which.effect == "stick", verdict.which.set


def test_a_user_s_own_effect_without_a_prior_is_refused():
    with pytest.raises(hdcal.InputError, match=r"stick\.force"):
        judged(simulated(ramp(14)), library=EFFECTS | {"stick": Stick})


@pytest.mark.slow
def test_curvature_of_a_load_cell_is_found():
    verdict = judged(hdcal.read_case(DATASETS / "nist-pontius"))
    assert verdict.gap.detected and verdict.which.effect in CURVATURE
    assert set(verdict.which.set) <= CURVATURE
    assert_consistent(verdict)


@pytest.mark.slow
def test_curvature_outside_the_library_is_unknown():
    library = {n: e for n, e in EFFECTS.items() if n not in CURVATURE}
    verdict = judged(hdcal.read_case(DATASETS / "nist-pontius"), library=library)
    assert verdict.which.verdict == "unknown"
    assert verdict.which.effect is None
    assert_consistent(verdict)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_sixty_rows_of_noise_have_no_cause(seed):
    for correlation in (0.0, 0.5):
        case = simulated(cycles(60), seed=seed, correlation=correlation)
        assert judged(case).which.verdict == "none"


@pytest.mark.slow
@pytest.mark.parametrize("rows", [5, 6, 8])
def test_a_few_rows_are_enough_to_say_nothing(rows):
    verdict = judged(simulated(ramp(rows), seed=1))
    assert verdict.which.verdict == "none"
    assert_consistent(verdict)


@pytest.mark.slow
def test_one_temperature_and_one_block_are_no_obstacle():
    records = make_records(
        np.linspace(0.02, 0.54, 12),
        known={"temperature", "time"},
        time=np.arange(12.0),
    )
    verdict = judged(simulated(records, seed=1))
    assert_consistent(verdict)
    curved = {"progressive_stiffening": {"slope": 0.6}}
    verdict = judged(simulated(records, curved, seed=1))
    assert verdict.gap.detected
    assert_consistent(verdict)


def test_rounded_readings_are_named():
    """The display is coarser than the noise: nothing is wrong with the mean."""
    records = simulated(rich()).records
    verdict = judged(
        make_case(replace(records, force=2.0 * np.round(records.force / 2.0)))
    )
    assert verdict.gap.detected
    assert verdict.which.effect == "quantisation"
    assert verdict.which.amplitude.median == pytest.approx(2.0)
    # Rounding is noise: there is no mean force that it could close.
    assert verdict.shrink.closed is None
    assert "noise" in verdict.shrink.reason


@pytest.mark.thorough
def test_set_forces_are_not_rounded_ones():
    """A rig that is driven by force sets round numbers and reads the deformation."""
    records = simulated(rich()).records
    force = 10.0 * np.round(records.force / 10.0)
    moved = records.deformation + (force - records.force) / 195.0
    verdict = judged(make_case(replace(records, force=force, deformation=moved)))
    assert not verdict.gap.detected
    assert verdict.which.verdict == "none"
    assert verdict.which.inclusion.get("quantisation", 0.0) < 0.1


def many_runs(runs: int, rows: int, sd: float) -> hdcal.Case:
    """Return short runs, each with a zero of its own [N]; noise of 1 N."""
    rng = np.random.default_rng(5)
    run = np.repeat(np.arange(runs), rows)
    path = np.tile(np.linspace(0.05, 0.5, rows), runs)
    noise = rng.normal(0.0, 1.0, len(run)) + rng.normal(0.0, sd, runs)[run]
    records = make_records(path, known={"run", "runs"}, run=run)
    return make_case(replace(records, force=400.0 * path + noise))


@pytest.mark.thorough
def test_offsets_of_many_short_runs_are_found():
    """No run shows its own; together they do, and a run tells of its other rows."""
    verdict = judged(many_runs(20, 5, 3.0))
    assert verdict.gap.detected
    assert verdict.which.effect == "run_offset"
    assert verdict.shrink.held_out == "leave-one-quarter-out"
    assert verdict.shrink.closed.median > 0.5
    assert not judged(many_runs(20, 5, 0.0)).gap.detected


def test_a_falling_force_is_refused():
    records = ramp(20)
    with pytest.raises(hdcal.InputError, match="does not grow"):
        judged(make_case(replace(records, force=-400.0 * records.deformation)))


@pytest.mark.thorough
def test_a_weak_effect_is_not_one_that_looks_alike():
    """Friction and fatigue share almost nothing in a cyclic test."""
    pairs = judged(simulated(rich())).which.inseparable
    assert ("coulomb_friction", "stiffness_fatigue") not in pairs
    assert ("thermal_expansion", "thermal_zero_drift") in pairs
