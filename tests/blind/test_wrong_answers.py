"""An honest diagnoser meets the bar; each wrong one misses just the rows it should."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from handmade import order_of
from honest import EFFECTS, FAMILIES, PAIRS, Check, make_check, worded

from hdcal.blind.label import CaseAnswer
from hdcal.blind.scoring.bar import BarResult, bar
from hdcal.blind.scoring.file_order import order_dependence
from hdcal.blind.scoring.reliability import reliabilities
from hdcal.blind.scoring.scored_case import match_answers
from hdcal.blind.scoring.scores import score

NO_TARGET = {"gap"}
# By who names one effect in every case.
MISSED_BY_ONE_NAME = {
    "false_alarm_iid",
    "false_alarm_ar",
    "false_alarm_strong",
    "false_alarm_log",
    "named_on_null",
    "top1_rich_r1",
    "oracle_r1",
    "top1_rich_r0.5",
    "oracle_r0.5",
    "top1_r1_2",
    "top1_r5",
    "group_r1",
    "group_r2",
    "top1_rich_r2",
    "said_right",
    "set_holds",
    "precision",
    "unknown_spanned",
    "named_spanned",
    "unknown_unspanned",
    "named_unspanned",
    "named_withheld",
    "withheld_own",
    "composite_wrong",
    "calibration_top",
    "calibration_effects",
}


@pytest.fixture(scope="module")
def check() -> Check:
    """The cases and the honest answers to them."""
    return make_check()


def rows_of(check: Check, answers: Sequence[CaseAnswer]) -> dict[str, BarResult]:
    """Return the rows of the bar by key, without the rest of the score."""
    cases = match_answers(check.labels, answers, name="hdcal", all_of_them=True)
    stated = reliabilities([c for c in cases if c.label.case in check.mixed])
    order = order_dependence(cases)
    rows = bar(cases, check.closures, stated, order, FAMILIES)
    return {row.key: row for row in rows}


def missed(check: Check, answers: Sequence[CaseAnswer]) -> set[str]:
    """Return the keys of the rows that are missed."""
    return {key for key, row in rows_of(check, answers).items() if row.met is False}


def changed(
    check: Check, change: Callable[[CaseAnswer], CaseAnswer]
) -> list[CaseAnswer]:
    """Return every honest answer after a change."""
    return [change(answer) for answer in check.answers]


def certain(answer: CaseAnswer, effect: str) -> CaseAnswer:
    """Return an answer that is sure of one effect."""
    return replace(
        answer,
        verdict="named",
        effect=effect,
        set=(effect,),
        probabilities={name: float(name == effect) for name in (*EFFECTS, "none")},
        inclusion={name: float(name == effect) for name in EFFECTS},
        detected=True,
        amplitude={},
        closed=None,
    )


def test_the_honest_one_meets_every_row(check: Check):
    rows = rows_of(check, check.answers)
    open_rows = {key for key, row in rows.items() if row.met is None}
    assert open_rows == NO_TARGET
    assert all(row.met for key, row in rows.items() if key not in NO_TARGET)
    assert all(row.n >= 20 for row in rows.values())


def test_the_score_holds_these_rows(check: Check):
    plain = {"calibration_cases": check.mixed, "closures": check.closures}
    found = score(check.labels, {"hdcal": check.answers}, FAMILIES, **plain)
    assert found.bar == [*rows_of(check, check.answers).values()]


def test_the_honest_one_meets_them_with_other_cases():
    # Rows on few cases may miss by chance; these rest on hundreds.
    other = make_check(800, seed=11)
    rows = rows_of(other, other.answers)
    for key in ("calibration_top", "calibration_effects", "precision", "order"):
        assert rows[key].met, key


def test_one_who_always_names_the_same_effect(check: Check):
    answers = changed(check, lambda answer: certain(answer, EFFECTS[0]))
    assert missed(check, answers) == MISSED_BY_ONE_NAME


def test_one_who_reads_noise_as_effects(check: Check):
    quiet = {label.case for label in check.labels if label.kind == "null"}
    first = EFFECTS[-1]
    answers = [
        certain(answer, first) if answer.case in quiet else answer
        for answer in check.answers
    ]
    assert missed(check, answers) == {
        "false_alarm_iid",
        "false_alarm_ar",
        "false_alarm_strong",
        "false_alarm_log",
        "named_on_null",
        "said_right",
        "precision",
        "calibration_top",
        "calibration_effects",
    }


def sharpened(answer: CaseAnswer) -> CaseAnswer:
    """Return an answer three times as sure of everything."""
    cubed = {name: p**3 for name, p in answer.probabilities.items()}
    total = sum(cubed.values())
    chances = {name: p / total for name, p in cubed.items()}
    after = worded(replace(answer, probabilities=chances))
    return replace(after, amplitude=answer.amplitude, closed=answer.closed)


def test_one_who_is_surer_than_he_may_be(check: Check):
    rows = rows_of(check, changed(check, sharpened))
    failed = {key for key, row in rows.items() if row.met is False}
    assert failed == {"calibration_top", "calibration_effects", "said_right"}
    assert rows["top1_rich_r0.5"].met and rows["top1_rich_r1"].met


def test_one_who_is_less_sure_than_he_could_be(check: Check):
    def flattened(answer: CaseAnswer) -> CaseAnswer:
        rooted = {name: p**0.2 for name, p in answer.probabilities.items()}
        total = sum(rooted.values())
        chances = {name: p / total for name, p in rooted.items()}
        return replace(answer, probabilities=chances)

    # Only the probabilities of whole hypotheses are flat here.
    assert missed(check, changed(check, flattened)) == {"calibration_top"}


def test_one_who_takes_the_files_to_be_sorted_by_effect(check: Check):
    n = len(check.answers)
    answers = [
        certain(answer, EFFECTS[place * len(EFFECTS) // n])
        for place, answer in enumerate(check.answers)
    ]
    assert missed(check, answers) == MISSED_BY_ONE_NAME | {"order"}


def test_one_who_answers_with_the_truth_next_door(check: Check):
    before = [check.labels[-1], *check.labels[:-1]]
    answers = [
        certain(answer, label.truth[0] if label.kind == "effect" else EFFECTS[0])
        for answer, label in zip(check.answers, before, strict=True)
    ]
    assert "order" in missed(check, answers)
    found = order_of(check.labels, answers)
    assert found.truth_of_neighbour.p_value < 0.01
    assert found.truth_of_neighbour.seen > 1.5 * (found.truth_of_neighbour.expected)


def test_cases_that_are_not_shuffled_are_seen(check: Check):
    ranked = sorted(check.labels, key=lambda label: label.truth)
    names = {label.case: f"case-{i:05d}" for i, label in enumerate(ranked)}
    labels = [replace(label, case=names[label.case]) for label in check.labels]
    answers = [replace(a, case=names[a.case]) for a in check.answers]
    found = order_of(labels, answers)
    assert found.truth_itself.p_value < 0.01
    # The order held the truth, but these answers took nothing from it.
    assert found.p_value > 0.01
    assert order_of(check.labels, check.answers).truth_itself.p_value > 0.01


def test_one_whose_intervals_are_too_narrow_or_too_wide(check: Check):
    def stretched(factor: float) -> list[CaseAnswer]:
        return changed(
            check,
            lambda answer: replace(
                answer,
                amplitude={
                    name: (mid, mid - factor * (mid - lo), mid + factor * (hi - mid))
                    for name, (mid, lo, hi) in answer.amplitude.items()
                },
            ),
        )

    assert missed(check, stretched(0.5)) == {"amplitude_holds"}
    assert missed(check, stretched(2.0)) == {"amplitude_holds"}


def test_one_who_overstates_what_is_closed(check: Check):
    answers = changed(
        check, lambda answer: replace(answer, closed=answer.closed and (1.0, 0.9, 1.0))
    )
    assert missed(check, answers) == {"closed"}


def test_pairs_keep_to_the_toy(check: Check):
    assert {"+".join(sorted(x.truth)) for x in check.labels if x.kind == "pair"} == {
        *PAIRS
    }
