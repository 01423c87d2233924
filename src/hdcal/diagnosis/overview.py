"""Many diagnoses at once: their answer, and a table with a row for each."""

from collections.abc import Mapping
from pathlib import Path

from hdcal.diagnosis.answer import RefusedAnswer, VerdictAnswer, VerdictsAnswer
from hdcal.diagnosis.document import verdict_document
from hdcal.diagnosis.many_cases import REFUSED, AskedCases, Refused
from hdcal.diagnosis.words import count_words, verdict_word
from hdcal.report.document import Document, Section, Table, spoken_of
from hdcal.report.plain import as_json
from hdcal.report.words import hypothesis, known, load, percent

_MEND = "Mend what is listed as refused."


def document_and_answer(
    found: Mapping[str, VerdictAnswer],
    asked: AskedCases,
) -> tuple[Document, VerdictAnswer | VerdictsAnswer]:
    """Return what a command shows: of one case its verdict, of many an overview.

    Args:
        found: answers by the names of the cases.
        asked: the cases, those that were refused among them.
    """
    if not asked.many:
        (one,) = found.values()
        return spoken_of(verdict_document(one), one.gear.theory), one
    together = verdicts_answer(found, asked.refused)
    return overview_document(together), together


def write_refused(refused: Refused, folder: Path) -> None:
    """Write what is wrong with the cases that have no answer, if there are any."""
    if not refused:
        return
    answer = RefusedAnswer(
        status="failed",
        reasons=tuple(f"{name}: refused" for name in refused),
        headline=f"{len(refused)} refused",
        next_step=_MEND,
        cases=dict(refused),
    )
    (folder / REFUSED).write_text(as_json(answer), "utf-8")


def verdicts_answer(
    found: Mapping[str, VerdictAnswer], refused: Refused | None = None
) -> VerdictsAnswer:
    """Return the answer about many cases, by the names of the cases."""
    failed = [name for name, one in found.items() if one.status != "ok"]
    return VerdictsAnswer(
        status="failed" if failed else "ok",
        reasons=tuple(f"{name}: failed" for name in failed),
        headline=count_words(found) + (f", {len(refused)} refused" if refused else ""),
        next_step=_MEND if refused else None,
        cases=dict(found),
        refused=dict(refused or {}),
    )


def overview_document(found: VerdictsAnswer) -> Document:
    """Return one table with a row for each of many cases."""
    numbers = ("probability", "gap", "closed")
    rows = [_overview_row(name, one) for name, one in found.cases.items()]
    table = Table(["case", "verdict", "cause", *numbers], rows, frozenset(numbers))
    return Document(
        name=f"{len(rows)} of {len(rows) + len(found.refused)} cases",
        kind="diagnoses",
        subtitle="diagnosed one by one",
        headline=f"{found.headline}.",
        sections=[Section("Verdicts", [table], brief=True), *_refused(found.refused)],
    )


def _refused(refused: Refused) -> list[Section]:
    """Return what is wrong with the cases that have no answer."""
    if not refused:
        return []
    rows = [[case, str(each)] for case, found in refused.items() for each in found]
    table = Table(["case", "what is wrong"], rows, frozenset())
    return [Section("Refused", [table], brief=True)]


def _overview_row(name: str, found: VerdictAnswer) -> list[str]:
    which, closed = found.which, found.shrink.closed
    size = found.gap.rms_N.median
    if found.status != "ok":
        return [name, verdict_word(found), "", "", "", ""]
    word = which.verdict
    cause = word if which.effect is None else which.effect
    chance = which.inclusion.get(cause, which.probabilities.get(cause))
    return [
        name,
        word,
        "–" if word == "none" else hypothesis(cause),
        percent(chance),
        load(size, found.units) if known(size) else "–",
        "–" if closed is None else percent(closed.median),
    ]
