"""The scores of a blind check: rows with targets, and tables by groups of cases."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.blind.calibration import (
    Statements,
    calibration_error,
    statements,
)
from benchmarks.blind.estimates import Estimate, mean, median, share
from benchmarks.blind.label import NONE, UNKNOWN
from benchmarks.blind.scored_case import Cases, ScoredCase

# Smaller statements on single effects do not count for their calibration.
_LEAST_STATED = 0.05


@dataclass(frozen=True)
class Row:
    """One score.

    Attributes:
        what: in words.
        found: the score.
        target: what it should be at least and at most; None without a target.
        unit: share, effects or nat.
    """

    what: str
    found: Estimate
    target: tuple[float, float] | None = None
    unit: str = "share"

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without cases or a target."""
        if self.found.value is None or self.target is None:
            return None
        return self.target[0] <= self.found.value <= self.target[1]


def at_least(value: float) -> tuple[float, float]:
    """Return a target with a lower end."""
    return value, float("inf")


def at_most(value: float) -> tuple[float, float]:
    """Return a target with an upper end."""
    return float("-inf"), value


def score_rows(cases: Cases, closable: Mapping[str, float]) -> list[Row]:
    """Return every score that has a target, and some that have none.

    Args:
        cases: of one diagnoser.
        closable: case → share of its gap that the true effect's form can close.
    """
    return [
        *_detection(cases),
        *_causes(cases),
        *_groups(cases),
        *_outside(cases),
        *_sizes([c for c in cases if c.at(1.0)], closable),
        *_calibration(cases),
    ]


def _detection(cases: Cases) -> Iterator[Row]:
    null = [c for c in cases if c.label.kind == "null"]
    for noise, words in (
        ("iid", "independent noise"),
        ("ar", "serial noise up to 0.5"),
        ("strong", "serial noise of 0.5 to 0.95"),
        ("log", "oversampled logs"),
    ):
        alarms = share(c.answer.detected for c in null if c.noise == noise)
        yield Row(f"false alarms without a gap, {words}", alarms, at_most(0.05))
    named = share(c.named for c in null)
    yield Row("an effect named without a gap", named, at_most(0.01))
    large = [c for c in cases if c.label.kind == "effect"]
    large = [c for c in large if c.label.r * c.label.rows**0.5 >= 5.0]
    detected = share(c.answer.detected for c in large)
    yield Row("effects detected from r√n = 5 on", detected, at_least(0.9))


def _causes(cases: Cases) -> Iterator[Row]:
    known = [c for c in cases if c.one_effect]
    rich = [c for c in known if c.label.program == "rich"]
    for r, target in ((0.5, 0.78), (1.0, 0.94), (2.0, 0.98)):
        first = share(c.credit for c in rich if c.at(r))
        words = f"true effect first at r = {r:g}, rich program"
        yield Row(words, first, at_least(target))
    first = share(c.credit for c in known if c.at(1.0, 2.0))
    yield Row("true effect first at r = 1 to 2, all programs", first, at_least(0.85))
    first = share(c.credit for c in known if c.at(5.0))
    yield Row("true effect first at r = 5, all programs", first, at_least(0.7))
    holds = share(c.set_holds for c in known if c.label.r >= 0.475)
    yield Row("90 % set holds the true effect, r ≥ 0.5", holds, at_least(0.9))
    size = mean([float(len(c.answer.set)) for c in known if c.at(1.0)])
    yield Row("size of the 90 % set at r = 1", size, at_most(1.6), "effects")
    words = "a named effect is a true one, all kinds of cases"
    yield Row(words, precision(cases), at_least(0.98))
    named = share(c.named_right for c in known if c.label.r >= 0.95)
    yield Row("true effect named, r ≥ 1", named)


def precision(cases: Cases) -> Estimate:
    """Return how often a named effect is one that acts, none withheld."""
    return share(c.named_right for c in cases if c.named and not c.label.withheld)


def _groups(cases: Cases) -> Iterator[Row]:
    known = [c for c in cases if c.one_effect and c.label.program == "rich"]
    for r, target in ((1.0, 0.97), (2.0, 0.99)):
        first = share(c.group_credit for c in known if c.at(r))
        words = f"true group first at r = {r:g}, rich program"
        yield Row(words, first, at_least(target))
    stated = share(c.stated for c in known if c.at(2.0))
    words = "a group or an effect stated at r = 2, rich program"
    yield Row(words, stated, at_least(0.9))
    counted = [c for c in cases if c.stated and not c.label.withheld]
    words = "a stated group is a true one, all kinds of cases"
    yield Row(words, share(c.stated_right for c in counted), at_least(0.99))


def _outside(cases: Cases) -> Iterator[Row]:
    outside = [c for c in cases if c.label.kind == "outside" and c.label.r >= 0.95]
    for words, listed, unknown, named in (
        ("of the list given beforehand", True, 0.9, 0.05),
        ("chosen blind", False, 0.88, 0.04),
    ):
        some, words = [c for c in outside if c.listed is listed], f"outside, {words}"
        called = share(c.answer.verdict == UNKNOWN for c in some)
        yield Row(f"{words}: called unknown", called, at_least(unknown))
        wrong = share(c.named for c in some)
        yield Row(f"{words}: an effect named", wrong, at_most(named))
    withheld = [c for c in cases if c.withheld and c.at(1.0)]
    wrong = share(c.named for c in withheld)
    yield Row("true effect withheld, r = 1: another named", wrong, at_most(0.1))
    stated = [c for c in withheld if c.stated or c.answer.verdict == UNKNOWN]
    right = share(not c.stated or c.stated_right for c in stated)
    words = "true effect withheld, r = 1: its group stated, or unknown"
    yield Row(words, right, at_least(0.85))
    both = [c for c in cases if c.label.kind == "composite"]
    wrong = share(c.named and not c.named_right for c in both)
    words = "an effect and something outside: a wrong effect named"
    yield Row(words, wrong, at_most(0.05))


def _sizes(cases: Cases, closable: Mapping[str, float]) -> Iterator[Row]:
    amplitudes = [
        (true, case.answer.amplitude[name])
        for case in cases
        for name, true in case.label.amplitude.items()
        if name in case.answer.amplitude
    ]
    error, held = _compared(amplitudes)
    yield Row("error of the amplitude, r = 1", error, at_most(0.07))
    yield Row("95 % interval holds the amplitude, r = 1", held, (0.90, 0.98))
    gaps = [
        (float(np.sqrt(np.mean(np.square(case.label.curve)))), case.answer.gap)
        for case in cases
        if case.label.curve and case.answer.gap
    ]
    error, held = _compared([(true, gap) for true, gap in gaps if true > 0.0])
    yield Row("error of the size of the gap, r = 1", error)
    yield Row("95 % interval holds the size of the gap, r = 1", held, (0.90, 0.98))
    closed = [
        (closable[c.label.case], c.answer.closed)
        for c in cases
        if c.label.case in closable and c.answer.closed
    ]
    error = median([abs(span[0] - true) for true, span in closed])
    yield Row("error of the closed share, true effect first", error, at_most(0.08))
    held = share(span[1] <= true <= span[2] for true, span in closed)
    yield Row("95 % interval holds the closed share, true effect first", held)


def _compared(rows: list[tuple]) -> tuple[Estimate, Estimate]:
    """Return the median relative error, and how often the interval holds the truth."""
    return (
        median([abs(span[0] / true - 1.0) for true, span in rows]),
        share(span[1] <= true <= span[2] for true, span in rows),
    )


def _calibration(cases: Cases) -> Iterator[Row]:
    # Stated probabilities refer to the prior proportions, where the set has such cases.
    expected = [c for c in cases if c.label.mix == "prior"] or cases
    error = calibration_error(top_statements(expected))
    words = "calibration error of the most probable hypothesis"
    yield Row(words, error, at_most(0.05))
    error = calibration_error(effect_statements(expected))
    words = "calibration error of single effects given 5 % or more"
    yield Row(words, error, at_most(0.05))


def top_statements(cases: Cases) -> Statements:
    """Return the probability of the most probable hypothesis of each case."""
    return statements(
        (index, case.probabilities[case.top], case.top == case.truth)
        for index, case in enumerate(cases)
        if case.truth is not None
    )


def effect_statements(cases: Cases) -> Statements:
    """Return the probabilities that are stated of single effects."""
    return statements(
        (index, chance, name in case.label.truth)
        for index, case in enumerate(cases)
        if case.truth is not None
        for name, chance in case.answer.inclusion.items()
        if chance >= _LEAST_STATED
    )


# Columns of the tables by groups of cases.
COLUMNS: dict[str, Callable[[Cases], Estimate]] = {
    "first": lambda cases: share(c.credit for c in cases if c.one_effect),
    "group first": lambda cases: share(c.group_credit for c in cases if c.one_effect),
    "set holds": lambda cases: share(c.set_holds for c in cases if c.one_effect),
    "set size": lambda cases: mean([len(c.answer.set) for c in cases if c.one_effect]),
    "detected": lambda cases: share(
        c.answer.detected for c in cases if c.label.kind == "effect"
    ),
    "false alarms": lambda cases: share(
        c.answer.detected for c in cases if c.label.kind == "null"
    ),
    "names right": precision,
    "log score": lambda cases: mean([c.log_score for c in cases if c.truth]),
    "Brier score": lambda cases: mean([c.brier_score for c in cases if c.truth]),
}
_BY: dict[str, Callable[[ScoredCase], str]] = {
    "size": lambda c: f"r = {c.label.r:g}",
    "program": lambda c: c.label.program,
    "noise": lambda c: c.noise,
    "kind": lambda c: c.label.kind if not c.label.withheld else "withheld",
    "effect": lambda c: c.label.truth[0] if c.one_effect else "",
    "group": lambda c: c.group_of(c.label.truth[0]) if c.one_effect else "",
}


def tables(cases: Cases) -> dict[str, dict[str, dict[str, Estimate]]]:
    """Return the columns for every group of cases, by what they are grouped by."""
    found = {}
    for by, word in _BY.items():
        names = sorted({word(case) for case in cases} - {""})
        groups = {name: [c for c in cases if word(c) == name] for name in names}
        found[by] = {name: columns(some) for name, some in groups.items()}
    return found


def columns(cases: Cases) -> dict[str, Estimate]:
    """Return the columns of a table for some cases."""
    return {name: score(cases) for name, score in COLUMNS.items()}


def _in_words(case: ScoredCase) -> str:
    name = "+".join(case.label.truth) or NONE
    return f"withheld {name}" if case.withheld else name


def mix_ups(cases: Cases, most: int = 12) -> Sequence[tuple[str, str, int]]:
    """Return the most frequent wrong answers: truth, most probable, and cases."""
    wrong = Counter(
        (_in_words(case), case.top)
        for case in cases
        if case.truth is not None and case.top != case.truth
    )
    return [(*names, count) for names, count in wrong.most_common(most)]
