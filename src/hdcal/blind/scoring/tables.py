"""Tables: who is taken for whom, and the same numbers by size, program and noise."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hdcal.blind.scoring.bar import quiet
from hdcal.blind.scoring.estimates import mean, share
from hdcal.blind.scoring.judged import NONE, UNKNOWN, Judged
from hdcal.blind.scoring.proper import log_score
from hdcal.blind.scoring.sizes import amplitude_rows, closed_errors, gap_rows

PAIR, OUTSIDE, WITHHELD, REAL = "pair", "outside", "withheld", "real"


def confusion(cases: Sequence[Judged], families: Mapping[str, str]) -> dict[str, Any]:
    """Return how often each truth got each hypothesis as the most probable one.

    Args:
        cases: of one diagnoser.
        families: of the library's effects; effects are sorted by them.
    """
    counts = Counter((_row(case), _column(case.top)) for case in cases)
    rows = _sorted({row for row, _ in counts}, families)
    columns = _sorted({column for _, column in counts} | {NONE, UNKNOWN}, families)
    return {
        "truths": rows,
        "answers": columns,
        "families": {n: families[n] for n in (*rows, *columns) if n in families},
        "counts": [[counts[row, column] for column in columns] for row in rows],
    }


def _row(case: Judged) -> str:
    if case.label.kind == "null":
        return NONE
    if case.plain_effect:
        return case.label.truth[0]
    if case.withheld:
        return WITHHELD
    return {"outside": OUTSIDE, "real": REAL}.get(case.label.kind, PAIR)


def _column(top: str) -> str:
    return PAIR if "+" in top else top


def _sorted(names: set[str], families: Mapping[str, str]) -> list[str]:
    # None first and everything that is no single effect last.
    last = {NONE: -1, PAIR: 1, WITHHELD: 2, OUTSIDE: 3, REAL: 4, UNKNOWN: 5}
    return sorted(names, key=lambda n: (last.get(n, 0), families.get(n, "~"), n))


def mix_ups(table: Mapping[str, Any], most: int = 12) -> list[dict[str, Any]]:
    """Return the most frequent wrong answers of a confusion matrix."""
    right = {WITHHELD: UNKNOWN, OUTSIDE: UNKNOWN}
    found = [
        {"truth": truth, "answer": answer, "n": n, "of": sum(counts)}
        for truth, counts in zip(table["truths"], table["counts"], strict=True)
        for answer, n in zip(table["answers"], counts, strict=True)
        if n and truth != REAL and answer != right.get(truth, truth)
    ]
    return sorted(found, key=lambda row: -row["n"])[:most]


def numbers(
    cases: Sequence[Judged], families: Mapping[str, str], closures: Mapping[str, float]
) -> dict[str, Any]:
    """Return the numbers that every table shows, of some cases."""
    known = [c for c in cases if c.plain_effect]
    amplitude, gap = amplitude_rows(cases), gap_rows(cases)
    found = {
        "top1": share(c.credit for c in known),
        "family": share(_family_right(c, families) for c in known),
        "oracle": share(c.oracle_credit for c in known if c.label.oracle),
        "false_alarms": share(c.answer.detected for c in cases if _empty(c)),
        "detected": share(c.answer.detected for c in cases if c.label.kind == "effect"),
        "named": share(c.named for c in known),
        "precision": share(c.named_right for c in cases if _counts(c)),
        "set_holds": share(c.label.truth[0] in c.answer.set for c in known),
        "set_size": mean([float(len(c.answer.set)) for c in known]),
        "amplitude": amplitude.error,
        "amplitude_holds": amplitude.held,
        "gap": gap.error,
        "gap_holds": gap.held,
        "closed": closed_errors(cases, closures),
        "log_score": log_score(cases),
    }
    return {"n": len(cases), **{key: value.plain() for key, value in found.items()}}


def _empty(case: Judged) -> bool:
    return case.label.kind == "null"


def _counts(case: Judged) -> bool:
    return case.named and not case.label.withheld


def _family_right(case: Judged, families: Mapping[str, str]) -> bool:
    first, truth = case.top_effect, case.label.truth[0]
    return first is not None and families.get(first, first) == families.get(
        truth, truth
    )


def by(
    cases: Sequence[Judged], word: Callable[[Judged], str], summed: Callable[..., dict]
) -> list[dict[str, Any]]:
    """Return the numbers of each group of cases.

    Args:
        cases: of one diagnoser.
        word: the group's name.
        summed: from cases to numbers.
    """
    names = sorted({word(case) for case in cases})
    return [
        {"name": name, **summed([c for c in cases if word(c) == name])}
        for name in names
    ]


def by_size(
    cases: Sequence[Judged], summed: Callable[..., dict]
) -> list[dict[str, Any]]:
    """Return the numbers by size of the gap, sizes within a factor of 2 together."""
    sized = [c for c in cases if c.label.r > 0.0 and math.isfinite(c.label.r)]
    groups: dict[int, list[Judged]] = {}
    for case in sized:
        groups.setdefault(round(math.log2(case.label.r)), []).append(case)
    rows = []
    for place in sorted(groups):
        sizes = sorted(case.label.r for case in groups[place])
        span = (sizes[0], sizes[-1])
        name = " to ".join(dict.fromkeys(f"{r:.2g}" for r in span))
        rows.append({"name": f"r = {name}", "r": span, **summed(groups[place])})
    return rows


def noise_word(case: Judged) -> str:
    """Return the kind of noise in words."""
    words = {"iid": "independent", "ar": "serially correlated"}
    return words.get(case.label.noise, case.label.noise)


def pairs(cases: Sequence[Judged]) -> dict[str, Any]:
    """Return how often two effects at once are told."""
    own = [c for c in cases if c.label.kind == "pair" and not c.label.withheld]

    def both(case: Judged) -> set[str | None]:
        return {case.answer.effect, case.answer.second_effect}

    found = {
        "pair_first": share(c.top == c.truth for c in own),
        "both_in_set": share(set(c.label.truth) <= set(c.answer.set) for c in own),
        "both_named": share(both(c) == set(c.label.truth) for c in own),
        "one_named_wrong": share(c.named and not c.named_right for c in own),
    }
    return {"n": len(own), **{key: value.plain() for key, value in found.items()}}


def rival_row(name: str, cases: Sequence[Judged]) -> dict[str, Any]:
    """Return what one diagnoser achieves, as a row beside the others."""
    known = [c for c in cases if c.plain_effect]
    silent = [*quiet(cases, "iid"), *quiet(cases, "ar")]
    found = {
        "top1_r1": share(c.credit for c in known if c.at(1.0)),
        "top1_r0.5": share(c.credit for c in known if c.at(0.5)),
        "top1": share(c.credit for c in known),
        "false_alarms": share(c.answer.detected for c in silent),
        "precision": share(c.named_right for c in cases if _counts(c)),
        "log_score": log_score(cases),
    }
    plain = {key: value.plain() for key, value in found.items()}
    return {"name": name, "n": len(cases), **plain}


def oracle_row(cases: Sequence[Judged]) -> dict[str, Any]:
    """Return the bound that the oracle sets; it knows that an effect acts."""
    known = [c for c in cases if c.plain_effect and c.label.oracle]
    return {
        "name": "oracle bound",
        "n": len(known),
        "top1_r1": share(c.oracle_credit for c in known if c.at(1.0)).plain(),
        "top1_r0.5": share(c.oracle_credit for c in known if c.at(0.5)).plain(),
        "top1": share(c.oracle_credit for c in known).plain(),
        "false_alarms": None,
        "precision": None,
        "log_score": None,
    }
