"""Gears of which something is wrong: left out whole, as half of one would mislead."""

from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.errors import Finding, quoted

_FIRST_FEW = 3


def bad_gears(
    findings: FileFindings, rows: np.ndarray, gears: Any
) -> dict[str, Finding]:
    """Return gears of which a row is wrong, each with the first thing that is.

    A row that names no gear is of none.

    Args:
        findings: what is wrong with the file.
        rows: row of the source of each reading, shape (n,).
        gears: label of each reading's, shape (n,).
    """
    found: dict[str, Finding] = {}
    if not findings.rows:
        return found
    for place in np.flatnonzero(np.isin(rows, [*findings.rows])):
        label = str(gears[place])
        if label and label not in found:
            found[label] = findings.of_row(int(rows[place]))
    return found


def among(names: Iterable[str], bad: Mapping[str, Finding]) -> np.ndarray:
    """Return which gears are bad, shape (g,)."""
    return np.array([name in bad for name in names], bool)


def offer(bad: Mapping[str, Finding], many: int | None = None) -> Finding:
    """Return that bad gears can be left out.

    Args:
        bad: at least one.
        many: gears there are in all; None where not all of them were read.
    """
    words = f"{len(bad)} of the gears read so far"
    words = words if many is None else f"{len(bad)} of {many} gears"
    words += f" {_be(bad)} bad: {_few(map(quoted, bad), len(bad))}"
    remedy = "Ask for it to leave such gears out, whole, and have the others answered"
    return Finding("skip_bad", words, remedy)


def left_out_words(left_out: Mapping[str, Finding], many: int) -> str:
    """Return which gears are left out, and why.

    Args:
        left_out: at least one.
        many: gears there were in all.
    """
    each = (f"{gear} ({cause(why)})" for gear, why in left_out.items())
    words = f"{len(left_out)} of {many} gears {_be(left_out)} left out"
    return f"{words}: {_few(each, len(left_out))}."


def cause(finding: Finding) -> str:
    """Return what is wrong with a gear; a row says where, its own file need not."""
    if finding.row is None:
        return finding.problem
    return f"{finding.where}: {finding.problem}"


def _be(gears: Mapping[str, Finding]) -> str:
    return "is" if len(gears) == 1 else "are"


def _few(words: Iterable[str], many: int) -> str:
    more = f" and {many - _FIRST_FEW} more" if many > _FIRST_FEW else ""
    return ", ".join(islice(words, _FIRST_FEW)) + more
