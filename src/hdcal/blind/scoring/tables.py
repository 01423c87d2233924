"""Tables: who is taken for whom, two effects at once, and the rivals side by side."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hdcal.blind.scoring.estimates import Estimate, share
from hdcal.blind.scoring.proper_scores import log_score
from hdcal.blind.scoring.scored_case import (
    NONE,
    UNKNOWN,
    Cases,
    ScoredCase,
    null_cases,
)

PAIR, OUTSIDE, WITHHELD, REAL = "pair", "outside", "withheld", "real"
COMPOSITE = "composite"


# A line of a table, by column: names, counts and estimates.
Row = dict[str, Any]


@dataclass(frozen=True)
class Confusion:
    """How often each truth (row) got each answer (column) as the most probable."""

    truths: list[str]
    answers: list[str]
    families: dict[str, str]
    counts: list[list[int]]


@dataclass(frozen=True)
class MixUp:
    """A wrong answer, and of how many cases with the same truth."""

    truth: str
    answer: str
    n: int
    of: int


def confusion(cases: Cases, families: Mapping[str, str]) -> Confusion:
    """Return how often each truth got each hypothesis as the most probable one.

    Args:
        cases: of one diagnoser.
        families: of the library's effects; effects are sorted by them.
    """
    counts = Counter((_row(case), _column(case.top)) for case in cases)
    rows = _sorted({row for row, _ in counts}, families)
    columns = _sorted({column for _, column in counts} | {NONE, UNKNOWN}, families)
    return Confusion(
        rows,
        columns,
        {n: families[n] for n in (*rows, *columns) if n in families},
        [[counts[row, column] for column in columns] for row in rows],
    )


def _row(case: ScoredCase) -> str:
    if case.label.kind == "null":
        return NONE
    if case.plain_effect:
        return case.label.truth[0]
    if case.withheld:
        return WITHHELD
    others = {"outside": OUTSIDE, "real": REAL, "composite": COMPOSITE}
    return others.get(case.label.kind, PAIR)


def _column(top: str) -> str:
    return PAIR if "+" in top else top


def _sorted(names: set[str], families: Mapping[str, str]) -> list[str]:
    # None first and everything that is no single effect last.
    last = {NONE: -1, PAIR: 1, COMPOSITE: 1.5, WITHHELD: 2, OUTSIDE: 3, REAL: 4}
    last[UNKNOWN] = 5
    return sorted(names, key=lambda n: (last.get(n, 0), families.get(n, "~"), n))


def mix_ups(table: Confusion, most: int = 12) -> list[MixUp]:
    """Return the most frequent wrong answers of a confusion matrix."""
    right = {WITHHELD: UNKNOWN, OUTSIDE: UNKNOWN}
    found = [
        MixUp(truth, answer, n, sum(counts))
        for truth, counts in zip(table.truths, table.counts, strict=True)
        for answer, n in zip(table.answers, counts, strict=True)
        if n and truth not in (REAL, COMPOSITE) and answer != right.get(truth, truth)
    ]
    return sorted(found, key=lambda row: -row.n)[:most]


def pairs(cases: Cases) -> Row:
    """Return how often two effects at once are found."""
    own = [c for c in cases if c.label.kind == "pair" and not c.label.withheld]

    def both(case: ScoredCase) -> set[str | None]:
        return {case.answer.effect, case.answer.second_effect}

    return {
        "n": len(own),
        "pair_first": share(c.top == c.truth for c in own),
        "both_in_set": share(set(c.label.truth) <= set(c.answer.set) for c in own),
        "both_named": share(both(c) == set(c.label.truth) for c in own),
        "one_named_wrong": share(c.named and not c.named_right for c in own),
    }


def rivals(found: Mapping[str, Cases], own: Cases) -> list[Row]:
    """Return what each diagnoser achieves, and the bound that the oracle sets.

    Args:
        found: cases by diagnoser.
        own: of the judged one, for the oracle, who knows that an effect acts.
    """
    rows: list[Row] = []
    for name, cases in found.items():
        silent = [*null_cases(cases, "iid"), *null_cases(cases, "ar")]
        rows.append(
            {
                "name": name,
                "n": len(cases),
                **_first([c for c in cases if c.plain_effect], lambda c: c.credit),
                "false_alarms": share(c.answer.detected for c in silent),
                "precision": precision(cases),
                "log_score": log_score(cases),
            }
        )
    known = [c for c in own if c.plain_effect and c.label.oracle]
    bound = _first(known, lambda c: c.oracle_credit)
    unknown = dict.fromkeys(("false_alarms", "precision", "log_score"))
    return [*rows, {"name": "oracle bound", "n": len(known), **bound, **unknown}]


def _first(cases: Cases, credit: Callable[[ScoredCase], float]) -> dict[str, Estimate]:
    """Return how often the true effect comes first, by size of the gap."""
    return {
        "top1_r1": share(credit(c) for c in cases if c.at(1.0)),
        "top1_r0.5": share(credit(c) for c in cases if c.at(0.5)),
        "top1": share(credit(c) for c in cases),
    }


def precision(cases: Cases) -> Estimate:
    """Return how often a named effect is one that acts, none withheld."""
    return share(c.named_right for c in cases if c.named and not c.label.withheld)
