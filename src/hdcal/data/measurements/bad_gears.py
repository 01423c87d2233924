"""Gears with a faulty row: left out whole, as half of one would mislead."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.errors import Finding, quoted, shortened

_LISTED = 3


def bad_gears(
    findings: FileFindings, rows: np.ndarray, gears: Any
) -> dict[str, Finding]:
    """Return the gears with a faulty row, each with its first fault."""
    bad: dict[str, Finding] = {}
    for place in np.flatnonzero(np.isin(rows, [*findings.rows])):
        if label := str(gears[place]):
            bad.setdefault(label, findings.rows[int(rows[place])])
    return bad


def among(names: Iterable[str], bad: Mapping[str, Finding]) -> np.ndarray:
    """Return which gears are bad, shape (g,)."""
    return np.array([name in bad for name in names], bool)


def offer(bad: Mapping[str, Finding], many: int | None = None) -> Finding:
    """Return that bad gears can be left out; `many` counts all, where it is known."""
    verb = "is" if len(bad) == 1 else "are"
    words = f"{len(bad)} of {many or 'the'} gears {verb} faulty: "
    words += shortened([*map(quoted, bad)], _LISTED)
    remedy = "Use this option to leave these gears out and evaluate the others"
    return Finding("skip_bad", words, remedy)


def left_out_words(left_out: Mapping[str, Finding], many: int) -> str:
    """Return which gears of many are left out, and why."""
    each = [f"{gear} ({cause(why)})" for gear, why in left_out.items()]
    verb = "is" if len(left_out) == 1 else "are"
    words = f"{len(left_out)} of {many} gears {verb} left out"
    return f"{words}: {shortened(each, _LISTED)}."


def cause(finding: Finding) -> str:
    """Return the fault of a gear, with its place where that is a row."""
    place = "" if finding.row is None else f"{finding.where}: "
    return f"{place}{finding.problem}"
