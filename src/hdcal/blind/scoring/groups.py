"""The same numbers by size, program, noise, effect and family."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from hdcal.blind.scoring.estimates import mean, share
from hdcal.blind.scoring.proper_scores import log_score
from hdcal.blind.scoring.scored_case import Cases, ScoredCase
from hdcal.blind.scoring.sizes import amplitude_sizes, closed_errors, gap_sizes
from hdcal.blind.scoring.tables import Row, precision

_NOISES = {"iid": "independent", "ar": "serially correlated", "log": "oversampled"}


def groups(
    cases: Cases, families: Mapping[str, str], closures: Mapping[str, float]
) -> dict[str, Any]:
    """Return the numbers of every group of cases, by what they are grouped by.

    Args:
        cases: of one diagnoser.
        families: family of each effect of the library.
        closures: case → true closed share of the best fit of the true effect's form.
    """
    known = [c for c in cases if c.plain_effect]

    def by(own: Cases, word: Callable[[ScoredCase], str]) -> list[Row]:
        found: dict[str, list[ScoredCase]] = {}
        for case in own:
            found.setdefault(word(case), []).append(case)
        return [
            {"name": name, **_numbers(found[name], families, closures)}
            for name in sorted(found)
        ]

    return {
        "by_r": [
            {**about, **_numbers(own, families, closures)}
            for about, own in _by_size(cases)
        ],
        "by_program": by(cases, lambda c: c.label.program),
        "by_noise": by(cases, lambda c: _NOISES.get(c.label.noise, c.label.noise)),
        "by_effect": by(known, lambda c: c.label.truth[0]),
        "by_family": by(known, lambda c: families.get(c.label.truth[0], "no family")),
    }


def _by_size(cases: Cases) -> list[tuple[Row, Cases]]:
    """Return groups by size of the gap, sizes within a factor of 2 together."""
    found: dict[int, list[ScoredCase]] = {}
    for case in cases:
        if case.label.r > 0.0 and math.isfinite(case.label.r):
            found.setdefault(round(math.log2(case.label.r)), []).append(case)
    rows = []
    for place in sorted(found):
        sizes = [case.label.r for case in found[place]]
        span = (min(sizes), max(sizes))
        name = " to ".join(dict.fromkeys(f"{r:.2g}" for r in span))
        rows.append(({"name": f"r = {name}", "r": span}, found[place]))
    return rows


def _numbers(
    cases: Cases, families: Mapping[str, str], closures: Mapping[str, float]
) -> Row:
    """Return the numbers that every table shows, of some cases."""
    known = [c for c in cases if c.plain_effect]
    null = [c for c in cases if c.label.kind == "null"]
    amplitude, gap = amplitude_sizes(cases), gap_sizes(cases)
    return {
        "n": len(cases),
        "top1": share(c.credit for c in known),
        "family": share(c.first_group_right(families) for c in known),
        "oracle": share(c.oracle_credit for c in known if c.label.oracle),
        "false_alarms": share(c.answer.detected for c in null),
        "detected": share(c.answer.detected for c in cases if c.label.kind == "effect"),
        "named": share(c.named for c in known),
        "precision": precision(cases),
        "set_holds": share(c.label.truth[0] in c.answer.set for c in known),
        "set_size": mean([float(len(c.answer.set)) for c in known]),
        "amplitude": amplitude.error,
        "amplitude_holds": amplitude.held,
        "gap": gap.error,
        "gap_holds": gap.held,
        "closed": closed_errors(cases, closures),
        "log_score": log_score(cases),
    }
