"""Scores of hand-made answers equal closed forms."""

import math

import numpy as np
import pytest
from benchmarks.blind.calibration import calibration_error, reliability, statements
from benchmarks.blind.estimates import mean, median, share
from benchmarks.blind.label import Label
from benchmarks.blind.scored_case import FLOOR, ScoredCase
from benchmarks.blind.scores import columns, mix_ups, score_rows, tables
from scipy.stats import norm
from stub_diagnosers import answer

GROUPS = {"slack": "contact", "stop": "contact", "drift": "time", "leak": "time"}
Z2 = norm.ppf(0.975) ** 2


def scored(chances, truth=("slack",), kind="effect", r=1.0, withheld=(), **more):
    """Return a case on the rich program; `more` are fields of the answer or label."""
    about = {k: more.pop(k) for k in ("curve", "amplitude_true", "mix") if k in more}
    about["amplitude"] = about.pop("amplitude_true", {})
    noise = more.pop("noise", "iid"), more.pop("correlation", 0.0)
    case = f"c{abs(hash((truth, kind, r, str(chances))))}"
    about["withheld"] = withheld
    label = Label(case, kind, truth, "rich", 180, r, *noise, 0.5, **about)
    return ScoredCase(label, answer(case, chances, GROUPS, **more), GROUPS)


def rows(cases, closable=None):
    """Return the scores by their words."""
    return {row.what: row for row in score_rows(cases, closable or {})}


def test_intervals():
    none = share([False] * 10)
    assert (none.value, none.lo) == (0.0, 0.0)
    assert none.hi == pytest.approx(Z2 / (10 + Z2))
    half = share([1, 0, 0.5, 0.5])
    width = math.sqrt(Z2 * (0.25 / 4 + Z2 / 64)) / (1 + Z2 / 4)
    assert (half.lo, half.hi) == pytest.approx((0.5 - width, 0.5 + width))
    assert share([]).value is None and median([]).n == 0
    assert (median([1.0]).value, median([1.0]).lo) == (1.0, None)
    values = np.random.default_rng(1).normal(size=400)
    found = mean(list(values))
    assert found.value == pytest.approx(values.mean())
    assert found.hi - found.lo == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.1)


def test_who_knows_the_truth_meets_every_target_and_who_says_none_does_not():
    cases, silent = [], []
    for r in (0.5, 1.0, 2.0, 5.0):
        for truth in GROUPS:
            cases += [scored({truth: 1.0}, (truth,), r=r)] * 5
            silent += [scored({"none": 1.0}, (truth,), r=r)] * 5
    for r in (1.0, 2.0):
        cases += [scored({"unknown": 1.0}, (n,), "outside", r) for n in ("hum", "burr")]
    cases += [scored({"none": 1.0}, (), "null", 0.0, noise="ar", correlation=0.6)] * 9
    cases += [scored({"unknown": 1.0}, withheld=("slack", "leak"))]
    met = [row.met for row in rows(cases).values()]
    assert met.count(False) == 0 and met.count(True) >= 17
    found = rows(silent)
    assert found["effects detected from r√n = 5 on"].found.value == 0.0
    assert found["true effect first at r = 1, rich program"].found.value == 0.0
    assert columns(silent)["log score"].value == pytest.approx(math.log(FLOOR))
    assert columns(silent)["Brier score"].value == 2.0
    assert (
        columns(cases)["Brier score"].value == columns(cases)["log score"].value == 0.0
    )


def test_first_effect_group_and_set():
    tie = scored({"slack": 0.4, "stop": 0.4, "none": 0.2}, set=("slack", "stop"))
    near = scored({"stop": 0.9, "slack": 0.1}, set=("stop",), verdict="group")
    far = scored({"leak": 0.6, "slack+stop": 0.4}, set=("leak", "slack"))
    found = rows([tie, near, far])
    assert found["true effect first at r = 1, rich program"].found.value == 0.5 / 3
    assert found["true group first at r = 1, rich program"].found.value == 2 / 3
    assert found["90 % set holds the true effect, r ≥ 0.5"].found.value == 2 / 3
    assert found["size of the 90 % set at r = 1"].found.value == 5 / 3
    stated = found["a stated group is a true one, all kinds of cases"].found
    assert (stated.value, stated.n) == (2 / 3, 3)
    assert mix_ups([near, far, far])[0] == ("slack", "leak", 2)


def test_names_are_counted_over_all_kinds_of_cases_but_withheld_ones():
    right, wrong = {"slack": 1.0}, {"leak": 1.0}
    cases = [
        scored(right),
        scored(wrong),
        scored(wrong, ("hum",), "outside"),
        scored(right, ("slack", "leak"), "pair"),
        scored(right, ("slack",), "composite"),
        scored(wrong, withheld=("slack", "stop")),
        scored({"none": 1.0}, (), "null", 0.0),
        scored(right, ("slack", "stop"), "real", 0.0),
    ]
    found = rows(cases)
    names = found["a named effect is a true one, all kinds of cases"].found
    assert (names.value, names.n) == (4 / 6, 6)
    assert found["true effect withheld, r = 1: another named"].found.value == 1.0
    assert found["outside, of the list given beforehand: an effect named"].found.n == 1
    kinds = tables(cases)["kind"]
    assert kinds["pair"]["names right"].value == 1.0
    assert "withheld" in kinds and kinds["withheld"]["first"].n == 0
    # Measured data have no single truth.
    assert columns(cases)["log score"].n == 7


def test_a_remainder_beside_an_effect_counts_for_the_effect():
    case = scored({"slack+unknown": 0.5, "slack": 0.3, "unknown": 0.2})
    assert case.probabilities == pytest.approx({"slack": 0.8, "unknown": 0.2})
    assert case.log_score == pytest.approx(math.log(0.8))


def test_false_alarms_are_counted_by_noise():
    kinds = (("iid", 0.0), ("ar", 0.3), ("ar", 0.7), ("log", 0.9))
    cases = [
        scored({"none": 1.0}, (), "null", 0.0, noise=n, correlation=c, detected=c > 0.5)
        for n, c in kinds
    ]
    found = [row.found.value for row in score_rows(cases, {})[:4]]
    assert found == [0.0, 0.0, 1.0, 1.0]


def test_sizes():
    right = {
        "curve": (0.3, -0.4),
        "amplitude_true": {"slack.clearance": 0.02},
        "amplitude": {"slack.clearance": (0.022, 0.019, 0.025)},
        "gap": (0.4, 0.36, 0.5),
        "closed": (0.8, 0.6, 0.85),
    }
    case = scored({"slack": 1.0}, **right)
    found = rows([case, case], {case.label.case: 0.9})
    gap = math.sqrt(0.125)
    values = {
        "error of the amplitude, r = 1": 0.1,
        "95 % interval holds the amplitude, r = 1": 1.0,
        "error of the size of the gap, r = 1": 0.4 / gap - 1.0,
        "95 % interval holds the size of the gap, r = 1": 0.0,
        "error of the closed share, true effect first": 0.1,
        "95 % interval holds the closed share, true effect first": 0.0,
    }
    assert {n: found[n].found.value for n in values} == pytest.approx(values)


def test_calibration_of_the_calibrated_and_of_the_overconfident():
    rng = np.random.default_rng(4)
    stated = rng.uniform(0.05, 0.95, 10_000)
    true = rng.random(10_000) < stated
    calibrated = calibration_error(
        statements(zip(range(10_000), stated, true, strict=True))
    )
    assert calibrated.value < 0.02
    # Of what is stated with 0.9, six in ten are true.
    rows_ = [(i, 0.9, i % 10 < 6) for i in range(2000)]
    sure = calibration_error(statements(rows_))
    assert sure.value == pytest.approx(0.3, abs=1e-6) and sure.lo < 0.3 < sure.hi
    ((mean_stated, share_true),) = reliability(statements(rows_))
    assert (mean_stated, share_true.value) == pytest.approx((0.9, 0.6))
