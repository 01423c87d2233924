"""Scores of hand-made answers equal closed forms."""

import math

import numpy as np
import pytest
from benchmarks.blind.calibration import calibration_error, reliability, statements
from benchmarks.blind.estimates import mean, median, share
from benchmarks.blind.label import NONE, OUTSIDE, Cause, Label
from benchmarks.blind.scored_case import FLOOR, ScoredCase
from benchmarks.blind.scores import mix_ups, score_rows, tables
from benchmarks.blind.temperature import TEMPERATURES, best_temperature
from scipy.stats import norm
from stub_diagnosers import answer

EFFECTS = ("slack", "stop", "drift", "leak")
Z2 = norm.ppf(0.975) ** 2


def scored(chances, truth=("slack",), kind="effect", r=1.0, **more):
    """Return a case on the rich program; `more` are fields of the answer or label."""
    about = {k: more.pop(k) for k in ("curve", "withheld") if k in more}
    noise, case = more.pop("noise", "iid"), f"{kind} {truth} {r} {chances}"
    label = Label(case, kind, truth, "rich", 180, r, noise, 0.0, 0.5, **about)
    return ScoredCase(label, answer(case, chances, EFFECTS, **more))


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
    cases, silent, closable = [], [], {}
    for r in (0.5, 1.0, 2.0):
        for number, truth in enumerate(EFFECTS * 5):
            # Nineteen of twenty intervals hold the truth.
            span = (0.9, 0.8, 0.95) if number else (0.5, 0.4, 0.6)
            classes = (Cause((truth,), 1.0, span),)
            case = scored({truth: 1.0}, (truth,), r=r, classes=classes)
            closable[case.label.case] = {truth: 0.9}
            cases.append(case)
            silent.append(scored({NONE: 1.0}, (truth,), r=r))
    cases += [scored({OUTSIDE: 1.0}, ("hum",), "outside", r) for r in (1.0, 2.0)]
    cases += [scored({NONE: 1.0}, (), "null", 0.0, noise=n) for n in ("iid", "ar")]
    cases += [scored({OUTSIDE: 1.0}, withheld=("slack", "leak"))]
    met = [row.met for row in rows(cases, closable).values()]
    assert met.count(False) == 0 and met.count(True) == 14
    found = rows(silent)
    assert found["true effect most probable, r = 1, rich loading"].found.value == 0.0
    score = found["log score of the true explanation"].found.value
    assert score == pytest.approx(math.log(FLOOR))
    assert rows(cases)["log score of the true explanation"].found.value == 0.0


def test_first_effect_set_and_classes():
    merged = (Cause(("stop", "slack"), 0.95),)
    tie = scored({"slack": 0.4, "stop": 0.4, NONE: 0.2}, set=("slack", "leak+stop"))
    near = scored({"stop": 0.95, "slack": 0.05}, classes=merged)
    far = scored({"leak": 0.995, NONE: 0.005}, set=("drift+slack",))
    pair = scored({"drift+slack": 1.0}, kind="composite", classes=merged)
    found = rows([tie, near, far, pair])
    expected = {
        "true effect most probable, r = 1, rich loading": (0.5 / 3, 3),
        "true effect or its class stated at 90 %, r ≥ 1": (1 / 3, 3),
        "of classes stated at 90 %, right": (2 / 3, 3),
        "of classes stated at 99 %, right": (0.0, 1),
        "effects in a class stated at 90 %, r ≥ 1": (1.5, 2),
        "90 % set holds the true effect, r ≥ 0.5": (2 / 3, 3),
        "explanations in the 90 % set, r = 1": (4 / 3, 3),
        "… beside an effect: the effect or its class stated at 90 %": (1.0, 1),
    }
    for words, (value, n) in expected.items():
        assert found[words].found.value == pytest.approx(value), words
        assert found[words].found.n == n, words
    assert mix_ups([near, far, far, pair])[0] == ("slack", "leak", 2)
    assert tables([tie, pair])["kind"].keys() == {"effect", "composite"}


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


def test_the_temperature_of_the_overconfident():
    # Odds of 9 to 1 where 3 to 1 are right: log 9 = 2 log 3.
    odds = 9.0 ** (1.0 / TEMPERATURES)
    right, wrong = np.log(odds / (1.0 + odds)), np.log(1.0 / (1.0 + odds))
    found = best_temperature(np.array([right] * 300 + [wrong] * 100).T)
    assert found.value == pytest.approx(2.0, rel=0.02)
    assert found.lo < 2.0 < found.hi
