"""Tables agree with examples made by hand; unfair answers and empty sets are met."""

import json
import math
from dataclasses import replace

import pytest
from handmade import KINDS, order_of, row, said, scored, truth
from honest import FAMILIES, make_check

from hdcal.blind.scoring.scores import Scores, score
from hdcal.blind.scoring.tables import MixUp
from hdcal.errors import InputError
from hdcal.report.plain import as_json


def check_finite(found: Scores) -> None:
    """Check that nothing in a score is NaN or infinite."""
    json.dumps(found, allow_nan=False, default=vars)


# Tables


def test_the_confusion_matrix_by_hand():
    labels = [
        truth("a"),
        truth("b", names=("drift",)),
        truth("c", "null", (), 0.0),
        truth("d", "pair", ("slack", "drift")),
        truth("e", withheld=("slack",)),
    ]
    answers = [
        said("a"),
        said("b"),
        said("c", "none", None),
        said("d", chances={"slack+drift": 1.0}),
        said("e", "unknown", None, chances={"unknown": 1.0}),
    ]
    found = scored(labels, answers)
    table = found.confusion
    assert table.truths == ["none", "slack", "drift", "pair", "withheld"]
    assert table.answers == ["none", "slack", "pair", "unknown"]
    assert table.counts == [
        [1, 0, 0, 0],
        [0, 1, 0, 0],
        [0, 1, 0, 0],
        [0, 0, 1, 0],
        [0, 0, 0, 1],
    ]
    assert found.mix_ups == [MixUp("drift", "slack", 1, 1)]
    assert found.pairs["pair_first"].value == 1.0


def test_the_family_may_be_right_where_the_effect_is_not():
    labels = [truth("a"), truth("b", names=("drift",))]
    found = scored(labels, [said("a", effect="friction"), said("b")])
    rich = found.by_program[0]
    assert (rich["name"], rich["n"]) == ("rich", 2)
    assert rich["top1"].value == 0.0
    assert rich["family"].value == 0.5
    assert [line["name"] for line in found.by_family] == ["rig", "time"]


def test_sizes_are_put_together_within_a_factor_of_two():
    labels = [truth(str(i), r=r) for i, r in enumerate([0.5, 1.0, 1.2, 5.0])]
    found = scored(labels, [said(x.case) for x in labels])
    assert [line["name"] for line in found.by_r] == [
        "r = 0.5",
        "r = 1 to 1.2",
        "r = 5",
    ]


def test_rivals_stand_beside_the_judged_one():
    labels = [truth("a", oracle={"slack": 1.0}), truth("b", "null", (), 0.0)]
    answers = [said("a"), said("b", "none", None, detected=False)]
    rival = [said("b", "named", "drift")]
    found = score(labels, {"hdcal": answers, "r2": rival}, KINDS)
    assert [line["name"] for line in found.rivals] == ["hdcal", "r2", "oracle bound"]
    assert found.rivals[1]["false_alarms"].value == 1.0
    assert found.rivals[1]["top1"].n == 0
    assert found.rivals[2]["top1"].value == 1.0


# Order


def test_too_few_cases_say_nothing_of_order():
    assert order_of([truth()], [said()]).p_value is None


# What must not be passed over


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ([], "no answer to case a"),
        ([said(), said()], "answered twice"),
        ([said(), said("z")], "no label for case z"),
        ([said(chances={"slack": 0.9})], "do not sum to 1"),
        ([said(chances={"slack": 1.0, "none": 1.0})], "do not sum to 1"),
        ([said(chances={"slack": 2.0, "none": -1.0})], "not from 0 to 1"),
        ([said(chances={"slack": math.nan})], "not from 0 to 1"),
    ],
)
def test_what_is_no_fair_answer_is_refused(answers, words):
    with pytest.raises(InputError, match=words):
        scored([truth()], answers)


def test_nothing_at_all_gives_null_everywhere():
    found = scored([], [])
    check_finite(found)
    assert all(line.met is None and line.n == 0 for line in found.bar)
    assert all(line.value is None for line in found.bar)


@pytest.mark.parametrize("count", [1, 2, 5, 40])
def test_few_cases_give_finite_numbers_or_null(count: int):
    check = make_check(40)
    labels, answers = check.labels[:count], check.answers[:count]
    found = score(labels, {"hdcal": answers, "none": []}, FAMILIES, check.closures)
    check_finite(found)
    for line in found.bar:
        assert (line.met is None) == (line.n == 0 or line.target is None)


def test_the_same_again_gives_the_same_and_order_of_answers_does_not_matter():
    check = make_check(60)
    one = score(check.labels, {"hdcal": check.answers}, FAMILIES)
    two = score(check.labels, {"hdcal": check.answers[::-1]}, FAMILIES)
    assert as_json(one) == as_json(two)


def test_an_answer_without_probabilities_is_scored_as_one():
    answer = replace(
        said(), probabilities={}, inclusion={}, verdict="none", effect=None
    )
    found = scored([truth()], [answer])
    assert found.log_score["hdcal"].value == pytest.approx(math.log(1e-6))
    assert row(found, "top1_r1_2").value == 0.0
    assert found.reliability.top.statements == 0
