"""Every row of the bar and every proper score agrees with an example made by hand."""

import math
from dataclasses import replace

import pytest
from handmade import row, said, scored, truth

from hdcal.blind.label import Label
from hdcal.blind.scoring.scored_case import ScoredCase, credit

# One case


def test_a_tie_counts_its_share_and_nothing_is_no_guess():
    assert credit({"a": 0.4, "b": 0.4, "c": 0.1}, "a") == 0.5
    assert credit({"a": 0.4, "b": 0.5}, "a") == 0.0
    assert credit({"a": 0.0, "b": 0.0}, "a") == 0.0
    assert credit({}, "a") == 0.0


@pytest.mark.parametrize(
    ("label", "expected"),
    [
        (truth(kind="null", names=()), "none"),
        (truth(), "slack"),
        (truth(withheld=("slack",)), "unknown"),
        (truth(kind="pair", names=("slack", "drift")), "drift+slack"),
        (truth(kind="pair", names=("slack", "drift"), withheld=("drift",)), "unknown"),
        (truth(kind="outside", names=("mice",)), "unknown"),
        (truth(kind="real"), None),
    ],
)
def test_the_true_hypothesis(label: Label, expected: str | None):
    assert ScoredCase(label, said()).truth == expected


def test_a_pair_has_one_spelling():
    judged = ScoredCase(truth(), said(chances={"slack+drift": 0.7, "none": 0.3}))
    assert judged.probabilities == {"drift+slack": 0.7, "none": 0.3}
    assert judged.top == "drift+slack"


# The bar


def test_false_alarms_by_hand():
    labels = [truth(f"q{i}", "null", (), 0.0) for i in range(4)]
    labels.append(truth("ar", "null", (), 0.0, noise="ar", correlation=0.5))
    labels.append(truth("strong", "null", (), 0.0, noise="ar", correlation=0.8))
    quiet = {"verdict": "none", "effect": None}
    answers = [said(x.case, **quiet, detected=x.case != "q0") for x in labels[:5]]
    answers.append(said("strong"))
    found = scored(labels, answers)
    assert row(found, "false_alarm_iid").value == 0.75
    assert row(found, "false_alarm_ar").n == 1
    assert row(found, "named_on_null").value == pytest.approx(1 / 6)


def test_detection_counts_from_five_standard_errors_on():
    labels = [truth("a", r=0.5), truth("b", r=0.5, rows=99), truth("c", r=5.0)]
    answers = [said(x.case, detected=x.case != "c") for x in labels]
    found = row(scored(labels, answers), "detected")
    assert (found.n, found.value, found.met) == (2, 0.5, False)


def test_the_first_effect_and_the_distance_to_the_oracle_by_hand():
    oracles = [{"slack": 0.9, "drift": 0.1}, {"slack": 0.2, "drift": 0.8}, {}]
    labels = [truth(str(i), oracle=o) for i, o in enumerate(oracles)]
    wrong = {"drift": 0.6, "slack": 0.4}
    answers = [said("0", chances=wrong), said("1"), said("2", verdict="ambiguous")]
    found = scored(labels, answers)
    assert row(found, "top1_rich_r1").value == pytest.approx(2 / 3)
    # The oracle is right once of two, the answers as well, on the other case.
    away = row(found, "oracle_r1")
    assert (away.value, away.n) == (0.0, 2)
    assert away.lo < 0.0 < away.hi
    assert row(found, "top1_r1_2").n == 3
    assert row(found, "top1_rich_r0.5").met is None


def test_programs_and_withheld_truths_do_not_mix_into_the_first_effect():
    labels = [truth("a", program="ramp"), truth("b", withheld=("slack",))]
    found = scored(labels, [said("a"), said("b", effect="drift")])
    assert row(found, "top1_rich_r1").n == 0
    assert row(found, "top1_r1_2").n == 1
    assert row(found, "named_withheld").value == 1.0
    assert row(found, "precision").n == 1


def test_the_set_by_hand():
    labels = [truth(str(i)) for i in range(4)]
    sets = [("slack",), ("drift", "slack"), ("drift",), ("drift", "none", "unknown")]
    answers = [said(str(i), set=names) for i, names in enumerate(sets)]
    found = scored(labels, answers)
    assert row(found, "set_holds").value == 0.5
    assert row(found, "set_size").value == 1.75
    assert row(found, "set_size").met is False


def test_precision_counts_names_over_all_kinds():
    labels = [
        truth("a"),
        truth("b", "pair", ("drift", "slack")),
        truth("c", "outside", ("mice",), spanned=True),
        truth("d", "real", ("slack", "friction")),
        truth("e", "null", (), 0.0),
        truth("f"),
    ]
    answers = [said(x.case) for x in labels[:5]] + [said("f", verdict="ambiguous")]
    found = row(scored(labels, answers), "precision")
    assert (found.n, found.value) == (5, 0.6)


def test_what_the_library_does_not_hold():
    labels = [
        truth(str(i), "outside", ("mice",), r, spanned=spanned)
        for i, (r, spanned) in enumerate(
            [(1.0, True), (2.0, True), (0.5, True), (1.0, False), (3.0, None)]
        )
    ]
    answers = [said("0"), *(said(str(i), "unknown", None) for i in range(1, 5))]
    found = scored(labels, answers)
    assert (row(found, "unknown_spanned").value) == 0.5
    assert (row(found, "named_spanned").value) == 0.5
    assert row(found, "unknown_unspanned").n == 1


def test_sizes_by_hand():
    true = {"slack.width": 2.0}
    curve = (3.0, -4.0)
    labels = [truth(str(i), amplitude=true, curve=curve) for i in range(3)]
    rms = math.sqrt(12.5)
    answers = [
        said("0", amplitude={"slack.width": (2.2, 2.0, 2.4)}, gap=(rms, 3.0, 4.0)),
        said("1", amplitude={"slack.width": (1.0, 0.5, 1.5)}, gap=(2 * rms, 6.0, 8.0)),
        said("2", amplitude={"drift.rate": (9.0, 8.0, 10.0)}),
    ]
    found = scored(labels, answers)
    assert row(found, "amplitude").value == pytest.approx((0.1 + 0.5) / 2)
    assert row(found, "amplitude_holds").value == 0.5
    assert row(found, "amplitude_holds").target == (0.90, 0.98)
    assert row(found, "gap").value == pytest.approx(0.5)
    assert row(found, "gap_holds").value == 0.5


def test_the_closed_share_counts_where_the_effect_is_right():
    labels = [truth("a"), truth("b"), truth("c"), truth("d", r=2.0)]
    span = (0.8, 0.7, 0.9)
    answers = [
        said("a", closed=span),
        said("b", effect="drift", closed=span),
        said("c", closed=None),
        said("d", closed=span),
    ]
    closures = {name: 0.9 for name in "abcd"}
    found = row(scored(labels, answers, closures=closures), "closed")
    assert (found.n, found.value) == (1, pytest.approx(0.1))
    assert found.met is False
    assert row(scored(labels, answers), "closed").met is None


def test_met_is_the_value_and_firm_the_interval():
    labels = [truth(str(i), "null", (), 0.0) for i in range(1000)]
    few = [said(str(i), "none", None, detected=i < 45) for i in range(1000)]
    found = row(scored(labels, few), "false_alarm_iid")
    assert (found.met, found.firm) == (True, False)
    none = [replace(answer, detected=False) for answer in few]
    found = row(scored(labels, none), "false_alarm_iid")
    assert (found.met, found.firm) == (True, True)
    assert found.interval == "Wilson 95 %"


# Proper scores


def test_log_and_brier_scores_by_hand():
    labels = [truth("a"), truth("b", "pair", ("slack", "drift")), truth("c", "real")]
    answers = [
        said("a", chances={"slack": 0.5, "drift": 0.25, "none": 0.25}),
        said("b", chances={"slack": 1.0}),
        said("c"),
    ]
    found = scored(labels, answers)
    log = (math.log(0.5) + math.log(1e-6)) / 2
    assert found.log_score["hdcal"].value == pytest.approx(log)
    assert found.log_score["hdcal"].n == 2
    assert found.brier["hdcal"].value == pytest.approx(
        (0.25 + 0.0625 + 0.0625 + 2.0) / 2
    )
