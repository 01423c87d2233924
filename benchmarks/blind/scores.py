"""The scores of a blind check: rows with targets, and tables by groups of cases.

A class is stated where it acts with 90 % or more and the likeliest explanation fits; it
is right where one of its effects acts.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.blind.calibration import (
    Statements,
    calibration_error,
    statements,
)
from benchmarks.blind.estimates import Estimate, mean, share
from benchmarks.blind.label import NONE, Cause
from benchmarks.blind.scored_case import STATED, Cases, ScoredCase

# Share of the gap's rms that each effect of the library can close, by case.
Closable = Mapping[str, Mapping[str, float]]
_SURE, _LIKELY = 0.99, 0.5
# Curves coincide where the cosine of their angle, squared, is 0.9 or more, as in the
# classes of a diagnosis: then one closes this share of the other's rms.
_COINCIDES = 1.0 - 0.1**0.5
# Smaller statements on classes do not count for their calibration.
_LEAST_STATED = 0.05
# Of smaller gaps the share that an effect closes is hardly known.
LEAST_CLOSED_R = 0.5


@dataclass(frozen=True)
class Row:
    """One score.

    Attributes:
        what: in words.
        found: the score.
        target: what it should be at least and at most; None without a target.
        unit: share, count or nat.
        within: the interval may reach the target in place of the score.
    """

    what: str
    found: Estimate
    target: tuple[float, float] | None = None
    unit: str = "share"
    within: bool = False

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without cases or a target."""
        if self.found.value is None or self.target is None:
            return None
        most = self.found.hi if self.within else None
        reached = self.found.value if most is None else most
        return self.target[0] <= reached and self.found.value <= self.target[1]


def at_least(value: float) -> tuple[float, float]:
    """Return a target with a lower end."""
    return value, float("inf")


def at_most(value: float) -> tuple[float, float]:
    """Return a target with an upper end."""
    return float("-inf"), value


def score_rows(cases: Cases, closable: Closable) -> list[Row]:
    """Return every score that has a target, and some that have none.

    Args:
        cases: of one diagnoser.
        closable: share of the gap's rms that each effect can close, by case.
    """
    return [
        *_causes(cases),
        *_probabilities(cases),
        *_false_alarms(cases),
        *_incomplete_library(cases, closable),
        *_sizes(cases, closable),
    ]


def _causes(cases: Cases) -> Iterator[Row]:
    known = [c for c in cases if c.one_effect]
    for r, target in ((0.5, 0.82), (1.0, 0.94), (2.0, 0.98)):
        rich = [c for c in known if c.label.program == "rich" and c.at(r)]
        words = f"true effect most probable, r = {r:g}, rich loading"
        first = share(c.credit for c in rich)
        yield Row(words, first, at_least(target), within=True)
    large = [c for c in known if c.at_least(1.0)]
    first = share(c.class_first for c in large)
    yield Row("likeliest class contains the true effect, r ≥ 1", first)
    stated = share(c.truth_stated for c in large)
    yield Row("true effect or its class stated at 90 %, r ≥ 1", stated, at_least(0.8))
    for level, target in ((STATED, 0.9), (_SURE, 0.98)):
        words = f"of classes stated at {100 * level:g} %, right"
        yield Row(words, right(cases, level), at_least(target))
    sizes = [
        len(c.members) for case in known for c in case.stated() if case.at_least(1.0)
    ]
    yield Row("effects in a class stated at 90 %, r ≥ 1", mean(sizes), None, "count")


def right(cases: Cases, level: float = STATED) -> Estimate:
    """Return how often stated classes are right, withheld effects left out."""
    counted = [c for c in cases if not c.label.withheld]
    return share(c.holds_truth(k) for c in counted for k in c.stated(level))


def _probabilities(cases: Cases) -> Iterator[Row]:
    error = calibration_error(class_statements(cases))
    yield Row("calibration error of class probabilities", error, at_most(0.03))
    known = [c for c in cases if c.one_effect]
    holds = share(c.set_holds for c in known if c.at_least(0.5))
    yield Row("90 % set holds the true effect, r ≥ 0.5", holds, at_least(0.92))
    size = mean([len(c.answer.set) for c in known if c.at(1.0)])
    words = "explanations in the 90 % set, r = 1"
    yield Row(words, size, at_most(1.5), "count")
    size = mean([c.merged_set for c in known if c.at(1.0)])
    yield Row("… effects of a class counted once", size, None, "count")
    yield Row("log score of the true explanation", log_score(cases), None, "nat")


def class_statements(cases: Cases) -> Statements:
    """Return the probabilities of classes, over all cases but withheld effects."""
    return statements(
        (index, chance, true)
        for index, case in enumerate(cases)
        if not case.label.withheld
        for chance, true in case.claims(_LEAST_STATED)
    )


def log_score(cases: Cases) -> Estimate:
    """Return the mean log score of the true explanation."""
    return mean([c.log_score for c in cases if c.truth is not None])


def _false_alarms(cases: Cases) -> Iterator[Row]:
    null = [c for c in cases if c.label.kind == "null"]
    for words, serial, target in (("independent", False, 0.03), ("serial", True, 0.05)):
        alarms = share(
            c.answer.detected for c in null if (c.label.noise != "iid") is serial
        )
        yield Row(f"false alarms, {words} noise", alarms, at_most(target))


def _incomplete_library(cases: Cases, closable: Closable) -> Iterator[Row]:
    outside = [c for c in cases if c.label.kind == "outside" and c.at_least(1.0)]
    both = [c for c in cases if c.label.kind == "composite"]
    whole = [c.outside_acts or closing_holds(c, closable) for c in outside]
    parts = [c.outside_acts or share_holds(c, closable) is True for c in both]
    words = "outside the library, r ≥ 1: stated to act, or the effect with its share"
    yield Row(words, share([*whole, *parts]), at_least(0.88))
    yield Row("… outside alone: stated to act", share(c.outside_acts for c in outside))
    words = "… beside an effect: stated to act, or the effect with its share"
    yield Row(words, share(parts))
    stated = share(c.truth_stated for c in both)
    yield Row("… beside an effect: the effect or its class stated at 90 %", stated)
    wrong = share(
        not c.outside_acts and any(differs(c, k, closable) for k in c.stated())
        for c in cases
        if c.withheld
    )
    words = "true effect withheld: a class of another curve stated at 90 %, alone"
    yield Row(words, wrong, at_most(0.05))


def _most(case: ScoredCase, cause: Cause, closable: Closable) -> float:
    """Return the largest share of the gap that an effect of a class can close."""
    shares = closable.get(case.label.case, {})
    return max((shares[name] for name in cause.members if name in shares), default=0.0)


def differs(case: ScoredCase, cause: Cause, closable: Closable) -> bool:
    """Return whether no curve of a class coincides with the gap."""
    return _most(case, cause, closable) < _COINCIDES


def closing_holds(case: ScoredCase, closable: Closable) -> bool:
    """Return whether a class is stated to act with the share that it can close."""
    return any(
        low <= _most(case, cause, closable) <= high
        for cause in case.answer.classes
        if cause.acts > _LIKELY and cause.explains
        for _, low, high in [cause.explains]
    )


def share_holds(case: ScoredCase, closable: Closable) -> bool | None:
    """Return whether the interval of a share holds the truth.

    Returns:
        None where the true effect is not stated to act, or its share is not known.
    """
    cause = case.true_class
    true = closable.get(case.label.case, {}).get(case.label.truth[0])
    if cause.acts <= _LIKELY or cause.explains is None or true is None:
        return None
    _, low, high = cause.explains
    return low <= true <= high


def _sizes(cases: Cases, closable: Closable) -> Iterator[Row]:
    for words, kinds, target in (
        ("interval holds the share of the gap closed", ("effect", "composite"), True),
        ("… of one effect alone", ("effect",), False),
        ("… of an effect beside something outside", ("composite",), False),
    ):
        held = [share_holds(c, closable) for c in cases if c.label.kind in kinds]
        found = share(each for each in held if each is not None)
        yield Row(words, found, (0.9, 0.98) if target else None)
    gaps = [
        (float(np.sqrt(np.mean(np.square(c.label.curve)))), c.answer.gap_N)
        for c in cases
        if any(c.label.curve) and c.at_least(LEAST_CLOSED_R) and c.answer.gap_N
    ]
    held = share(low <= true <= high for true, (_, low, high) in gaps)
    yield Row("interval holds the rms of the gap, r ≥ 0.5", held)


# Columns of the tables by groups of cases.
COLUMNS: dict[str, Callable[[Cases], Estimate]] = {
    "first": lambda cases: share(c.credit for c in cases if c.one_effect),
    "stated at 90 %": lambda cases: share(
        c.truth_stated for c in cases if c.one_effect
    ),
    "stated, right": right,
    "set holds": lambda cases: share(c.set_holds for c in cases if c.one_effect),
    "in the set": lambda cases: mean(
        [len(c.answer.set) for c in cases if c.one_effect]
    ),
    "outside acts": lambda cases: share(c.outside_acts for c in cases),
    "gap": lambda cases: share(
        c.answer.detected for c in cases if c.label.kind != "null"
    ),
    "false alarms": lambda cases: share(
        c.answer.detected for c in cases if c.label.kind == "null"
    ),
    "log score": log_score,
}
UNITS = {"in the set": "count", "log score": "nat"}
_BY: dict[str, Callable[[ScoredCase], str]] = {
    "kind": lambda c: "withheld" if c.withheld else c.label.kind,
    "size": lambda c: f"r = {c.label.r:g}",
    "program": lambda c: c.label.program,
    "noise": lambda c: c.label.noise,
    "effect": lambda c: c.label.truth[0] if c.one_effect else "",
}


def tables(cases: Cases) -> dict[str, dict[str, dict[str, Estimate]]]:
    """Return the columns for every group of cases, by what they are grouped by."""
    found = {}
    for by, word in _BY.items():
        names = sorted({word(case) for case in cases} - {""})
        groups = {name: [c for c in cases if word(c) == name] for name in names}
        found[by] = {
            name: {column: score(some) for column, score in COLUMNS.items()}
            for name, some in groups.items()
        }
    return found


def mix_ups(cases: Cases, most: int = 12) -> list[tuple[str, str, int]]:
    """Return the most frequent wrong answers: truth, most probable, and cases."""

    def words(case: ScoredCase) -> str:
        name = "+".join(case.label.truth) or NONE
        return f"withheld {name}" if case.withheld else name

    wrong = Counter(
        (words(case), case.top)
        for case in cases
        if case.truth is not None and case.top != case.truth
    )
    return [(*names, count) for names, count in wrong.most_common(most)]
