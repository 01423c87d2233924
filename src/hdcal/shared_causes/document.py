"""What gears have in common, in words: the only place of its sentences."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hdcal.diagnosis.naming import naming
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.report.document import (
    Document,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
    notices,
)
from hdcal.report.intervals import Interval
from hdcal.report.words import capital, label, percent, percent_span
from hdcal.shared_causes.answer import CausesAnswer, LotWithCauses, SharedCause
from hdcal.shared_causes.causes import FleetCauses

_AT_ONCE = 25
_MOST_NAMED, _MOST_TOLD, _MOST_LOTS = 3, 4, 20
# Causes of which less than this share of gears is expected to have them are in the
# JSON answer alone.
RARE = 0.01
_WORDS = {
    NONE: "no effect",
    UNKNOWN: "something outside the library",
}


def cause_words(cause: str) -> str:
    """Return a cause as people say it, with the doubt that its name has earned."""
    told = cause in _WORDS or naming().may_be_named(cause)
    return _short(cause) if told else f"what looks like {_short(cause)}"


def _short(cause: str) -> str:
    return _WORDS.get(cause, label(cause))


def headline(labels: Sequence[str], of_gears: Sequence[tuple[str, ...]]) -> str:
    """Return which gears have what, in one sentence.

    Args:
        labels: of the gears.
        of_gears: the causes that each one may have.
    """
    total, nothing = len(labels), (NONE,)
    # Of which it is not clear whether they have an effect is one kind.
    kinds = [() if NONE in own and own != nothing else own for own in of_gears]
    many = Counter(kinds)
    if many[nothing] == total:
        return f"None of {total} gears shows an effect."
    ranked = [kind for kind, _ in many.most_common() if kind not in ((), nothing)]
    told = []
    for kind in ranked[:_MOST_TOLD]:
        names = [name for name, own in zip(labels, kinds, strict=True) if own == kind]
        told.append(_of_some(kind, names))
    if rest := sum(many[kind] for kind in ranked[_MOST_TOLD:]):
        told.append(f"{rest} may have others")
    if unclear := many[()]:
        they = "they have" if unclear > 1 else "it has"
        told.append(f"of {unclear} it is not clear whether {they} an effect")
    if many[nothing]:
        told.append(f"{many[nothing]} show{'s' * (many[nothing] == 1)} none")
    return f"Of {total} gears {'; '.join(told)}."


def _of_some(kind: tuple[str, ...], names: Sequence[str]) -> str:
    """Return what some gears have."""
    has = "have" if len(names) > 1 else "has"
    who = ", ".join(names) if len(names) <= _MOST_NAMED else str(len(names))
    causes = " or ".join(map(cause_words, kind[:_MOST_NAMED]))
    if len(kind) > _MOST_NAMED:
        causes += f" or {len(kind) - _MOST_NAMED} other causes"
    if len(kind) == 1:
        return f"{who} {has} {causes}"
    together = "both" if len(kind) == 2 else "several"
    return f"{who} {has} {causes}, or {together}: these readings do not tell them apart"


def causes_document(
    found: FleetCauses,
    answer: CausesAnswer,
    columns: Mapping[str, np.ndarray],
    command: str,
) -> Document:
    """Return the report; its picture is called causes."""
    versions = ", ".join(f"{k} {v}" for k, v in answer.versions.items())
    provenance = [
        ("SHA-256 of the data", answer.data_sha256),
        ("sampling", f"Gibbs, {len(found.share)} draws, seed {answer.seed}"),
        ("versions", versions),
    ]
    told = [one for one in answer.causes if one.share.median >= RARE or one.gears_told]
    checks = Sentences([check.words for check in found.checks])
    return Document(
        name=found.case.name,
        kind="causes",
        subtitle=f"{answer.gears} gears, {answer.rows} readings",
        headline=answer.headline,
        answers=[] if found.reasons else list(_answers(told, answer.lots)),
        next_steps=[answer.next_step] if answer.next_step else [],
        notices=notices(("To be aware of", answer.notes)),
        sections=[
            _causes(told),
            _of_gears(columns),
            Section("Checks", [checks], False, True),
        ],
        provenance=provenance + ([("command", command)] if command else []),
        failed=found.reasons,
    )


def _answers(
    told: Sequence[SharedCause], lots: Sequence[LotWithCauses]
) -> Iterator[str]:
    parts = [f"{cause_words(one.cause)} {percent_span(one.share)}" for one in told]
    yield f"Of gears to come, with 95 % credible intervals: {'; '.join(parts)}."
    if 1 < len(lots) <= _MOST_LOTS:
        each = [
            f"{one.lot} {_span(one.gears_with_effect)} of {one.gears}" for one in lots
        ]
        yield f"Gears with an effect, or something unknown, by lot: {'; '.join(each)}."


def _span(gears: Interval) -> str:
    return f"{gears.median:.0f} ({gears.lo:.0f} … {gears.hi:.0f})"


def _causes(told: Sequence[SharedCause]) -> Section:
    numbers = ["gears that have it", "of these gears", "of gears to come", "all [nat]"]
    rows = [
        [
            capital(_short(one.cause)),
            str(one.gears_told),
            _span(one.gears),
            percent_span(one.share),
            f"{one.log_evidence_nat:.1f}",
        ]
        for one in told
    ]
    caption = "Share of gears to come that have each cause, 95 % credible intervals."
    words = (
        "Gears that have it: with 90 % probability. All: evidence over none, had every "
        "gear this one."
    )
    shown = Picture("causes", "How often each cause is", caption)
    blocks = [shown, Table(["cause", *numbers], rows, frozenset(numbers))]
    return Section("How often", [*blocks, Text(words, soft=True)], brief=True)


def _of_gears(columns: Mapping[str, np.ndarray]) -> Section:
    numbers = ["rows", "probability", "P(no effect)"]
    lots = ["lot"] if "lot" in columns else []
    titles = ["gear", *lots, "rows", "may have", *numbers[1:], "by itself"]
    order = np.argsort(columns["probability_none"], kind="stable")
    rows = [
        [
            str(columns["gear"][row]),
            *(str(columns[name][row]) for name in lots),
            str(columns["rows"][row]),
            " or ".join(map(_short, str(columns["causes"][row]).split(" / "))),
            percent(float(columns["probability"][row])),
            percent(float(columns["probability_none"][row])),
            f"{_short(str(columns['alone'][row]))} "
            f"({percent(float(columns['probability_alone'][row]))})",
        ]
        for row in order
    ]
    words = "By itself: without what the other gears say. All are in gears.csv."
    table = Table(titles, rows, frozenset(numbers), page=_AT_ONCE)
    return Section("The gears", [table, Text(words, soft=True)], brief=True)
