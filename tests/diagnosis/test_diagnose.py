"""Where the gap lies, which effect causes it, how far it closes, and what to test."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from rigs import make_records, ramp
from schema_checks import obeys

from hdcal.diagnosis.charts import gap_chart
from hdcal.diagnosis.decision import TEMPERATURE
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.gap import (
    GapByRow,
    _blocks,
    closed_on_left_out,
    fitted,
    gap_by_row,
)
from hdcal.diagnosis.next_run import candidate_runs, rank_runs
from hdcal.diagnosis.patterns import find_patterns
from hdcal.diagnosis.result import Diagnosis
from hdcal.evidence.linear_problem import linear_problem
from hdcal.evidence.search import Searched, search
from hdcal.physics.registry import EFFECTS
from hdcal.report.charts.chart_spec import Band, Line

HYSTERESIS = {"hysteresis": {"force": 4.0, "reach": 0.1}}


@pytest.fixture(scope="module")
def looped() -> Searched:
    return search(simulated(rich(), HYSTERESIS, seed=1), EFFECTS)


@pytest.fixture(scope="module")
def plain() -> Searched:
    return search(simulated(rich(), seed=1), EFFECTS)


def closed(searched: Searched, name: str):
    fit = fitted(searched, searched.table.posterior(TEMPERATURE), [name])
    rng = np.random.default_rng(0)
    return closed_on_left_out(searched, fit, [name], rng)[0]


def test_the_true_effect_closes_the_gap_on_rows_left_out(looped):
    found = closed(looped, "hysteresis")
    assert found is not None and found.median > 0.8 and found.lo > 0.5


@pytest.mark.parametrize("name", ["screw_error", "progressive_stiffening"])
def test_another_effect_does_not(looped, name):
    found = closed(looped, name)
    assert found is not None and found.hi < 0.3


def test_rows_left_out_are_half_cycles_or_where_these_are_few_stretches():
    block, word = _blocks(rich(), by_member=False)
    turns = np.diff(np.asarray(rich().sense)) != 0
    assert word == "a half cycle" and np.array_equal(np.diff(block) > 0, turns)
    block, word = _blocks(rich(), by_member=True)
    assert word == "a quarter of each run" and {*block} == {0, 1, 2, 3}
    block, word = _blocks(ramp(60), by_member=False)
    assert word == "a stretch of rows" and np.bincount(block).tolist() == [10] * 6


def test_the_share_that_closes_of_no_gap_is_not_known(plain):
    found = closed(plain, "hysteresis")
    assert found is None or found.hi - found.lo > 0.5


def test_the_gap_is_what_the_effect_adds(looped, plain):
    """Both cases have the same noise: they differ by the effect alone."""
    rng = np.random.default_rng(0)
    found = gap_by_row(looped, looped.table.posterior(TEMPERATURE), rng)
    added = looped.problem.project(looped.problem.y - plain.problem.y)
    low, high = np.quantile(found.draws, [0.025, 0.975], axis=0)
    assert np.mean((low <= added) & (added <= high)) > 0.8
    middle = np.median(found.draws, axis=0)
    assert np.sqrt(np.mean((middle - added) ** 2)) < 0.2 * np.std(added)
    nothing = gap_by_row(plain, plain.table.posterior(TEMPERATURE), rng)
    assert np.sqrt(np.mean(nothing.draws**2)) < 0.15 * np.std(added)


def test_a_diagnosis_contains_cause_share_ladder_and_notes():
    case = simulated(rich(), HYSTERESIS, seed=1)
    object.__setattr__(case, "notes", ("a note from reading",))
    found = diagnose(case, quick=True)
    (cause,) = found.which.acting
    named = len(cause.members) == 1
    assert found.which.verdict == ("named" if named else "group")
    assert cause.members[0] == "hysteresis" and cause.probability > 0.9
    assert cause.explains is not None and cause.explains.lo > 0.8
    assert "Hysteresis" in found.headline and "a note from reading" in found.page()
    sizes = [rung.rms_N for rung in found.how_far.ladder]
    assert sizes[:-1] == sorted(sizes[:-1], reverse=True)
    assert sizes[-1] == pytest.approx(found.gap.noise_sd_N)
    assert found.gap.rms_N is not None
    inside = found.gap.rms_N.lo, found.gap.rms_N.hi
    assert inside[0] < np.sqrt(sizes[1] ** 2 - sizes[-1] ** 2) < 1.1 * inside[1]
    (loop,) = [each for each in found.seen if each.covariate == "direction"]
    # Both branches of the hysteresis, 4 N each, fully developed on most of the stroke.
    assert loop.size_N.lo > 3.0 and loop.size_N.hi < 9.0
    obeys(found.to_dict(), Diagnosis)
    assert {*found.charts()} == {"where", "which", "how_far"}
    assert found.average is None and found.stiffness_N_per_mm is None


def test_a_plain_case_has_no_gap_and_nothing_to_close():
    found = diagnose(simulated(rich(), seed=3), quick=True)
    assert found.which.verdict == "none" and not found.which.acting
    assert found.how_far.closed is None and found.gap.probability < 0.5
    assert not found.seen and not any(one.explains for one in found.effects)
    obeys(found.to_dict(), Diagnosis)


def test_suggested_runs_separate_hypotheses():
    """A ramp does not separate stiffening from other bends."""
    case = simulated(ramp(60), {"progressive_stiffening": {"slope": 0.4}}, seed=1)
    searched = search(case, EFFECTS)
    runs = rank_runs(searched, searched.table.posterior(TEMPERATURE))
    assert runs and all(run.information_nats >= 0.02 for run in runs)
    assert all(one != two for one, two in (run.separates for run in runs))


def test_runs_that_were_measured_are_not_suggested():
    new, measured = (
        {run.words for run in candidate_runs(records, 20.0)}
        for records in (replace(ramp(60), known=frozenset({"time"})), rich())
    )
    done = {"load and unload at the same rate", "load and unload four times faster"}
    done |= {
        "load, then hold the largest {displacement} for one minute",
        "load and unload at 50 °C",
    }
    assert done <= new and not done & measured
    back = "return to the first temperature, 20 °C, and load again"
    assert back in measured - new


def test_the_gap_is_drawn_for_each_half_cycle():
    case = simulated(rich(), seed=1)
    count = len(case.records.force)
    draws = np.tile(np.arange(count, dtype=float), (5, 1))
    chart = gap_chart(case, GapByRow(case.records, np.zeros(count), draws))
    marks = chart.panels[0].marks
    lines = [mark for mark in marks if isinstance(mark, Line)]
    turns = np.count_nonzero(np.diff(np.asarray(case.records.sense))) + 1
    assert len(lines) == len([m for m in marks if isinstance(m, Band)]) == turns
    assert sum(len(line.x) for line in lines) == count
    assert all(np.all(np.diff(line.x) >= 0.0) for line in lines)


# What is added to the force [N], the covariate, and the swing that it has.
PATTERNS = {
    "loop": (lambda r: -1.0 * r.sense, "direction", 2.0),
    "zero": (lambda r: 0.05 * r.temperature, "temperature", 3.0),
    "runs": (lambda r: 2.0 * (r.run >= 3), "run", 2.0),
    "order": (lambda r: np.linspace(0.0, 3.0, len(r.run)), "order", 3.0),
}


@pytest.mark.parametrize("name", PATTERNS)
def test_a_pattern_has_its_covariate_and_size(name: str):
    add, covariate, swing = PATTERNS[name]
    records = rich()
    run = np.repeat(np.arange(6), 30)
    records = replace(records, run=run, known=records.known | {"run", "runs"})
    case = simulated(records, seed=1)
    force = np.asarray(case.records.force) + np.asarray(add(case.records))
    case = replace(
        case,
        records=replace(case.records, force=force),
        run_labels=tuple(map(str, range(6))),
    )
    found = find_patterns(linear_problem(case, {}), case)
    assert found[0].covariate == covariate and found[0].p_value < 1e-3
    assert found[0].size_N.lo < swing < found[0].size_N.hi
    assert 0.6 * swing < found[0].size_N.median < 1.5 * swing
    assert found[0].material
    assert not find_patterns(linear_problem(simulated(records, seed=1), {}), case)


def test_the_size_of_a_bend_through_zero_is_that_of_one_side():
    x = np.concatenate([np.linspace(-0.5, 0.5, 90), np.linspace(0.5, -0.5, 90)])
    records = make_records(
        x, known={"unloading", "cycles"}, sense=np.repeat([1.0, -1.0], 90)
    )
    case = simulated(records, seed=1)
    force = np.asarray(case.records.force) + 40.0 * x * np.abs(x)
    case = replace(case, records=replace(case.records, force=force))
    (bend,) = find_patterns(linear_problem(case, {}), case)
    # The ends lie a quarter of their 10 N off the line of least squares.
    assert "stiffens" in bend.statement
    assert bend.size_N.median == pytest.approx(2.5, abs=0.4)
