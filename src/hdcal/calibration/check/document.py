"""A check in words: the only place of its sentences."""

from collections.abc import Iterator

import numpy as np

from hdcal.calibration.check.answer import CheckAnswer, Ends
from hdcal.data.measurements import ASSUMED
from hdcal.report.document import Document, Facts, Section, Table, Text
from hdcal.report.words import known, number

HEADLINE = "The input is in order."
DOUBTFUL = "The input can be read, but the stiffness it shows is not plausible."
_MOST_LISTED = 8
EACH = (
    "Look at the specimens one by one: the command `fleet` says which of them is off."
)
# Specimens that are listed in a terminal.
_AT_ONCE = 20
_GAIN = (
    "the data cannot tell it from the stiffness, so it widens stiffness, K and the "
    "load on a gear, not the next reading of this rig"
)
_ZERO = "it is the prior of that zero, which a load on the gear leaves out"
STATED = {
    "force_gain": _GAIN,
    "deformation_gain": _GAIN,
    "temperature_offset": (
        "it shifts the temperature at which stiffness and loads hold, not that of the "
        "next reading of this rig"
    ),
    "force_offset": _ZERO,
    "deformation_offset": (
        "it adds to the error of finding the first contact; both widen a load"
    ),
}
OWN_SCATTER = (
    "force_sd is taken as scatter of its own in each row, which many rows average out, "
    "and not as a gain: an error common to all rows is a force_calibration"
)


def check_document(found: CheckAnswer, *, lacking: bool = False) -> Document:
    """Return the report of a check.

    Args:
        found: what was understood.
        lacking: whether each effect that cannot be tested is listed.
    """
    sections = [Section("Data and gear", [Facts(list(_facts(found, lacking)))], True)]
    if found.specimens:
        sections.append(_specimens(found))
    return Document(
        name=found.case,
        kind="check",
        subtitle="what was read",
        headline=found.headline,
        next_steps=[found.next_step] if found.next_step else [],
        sections=sections,
    )


def _specimens(found: CheckAnswer) -> Section:
    slopes = [one.stiffness_N_per_mm for one in found.specimens]
    span = float(np.ptp([slope for slope in slopes if known(slope)] or [0.0]))
    titles = ["specimen", "rows", "runs", "N/mm"]
    rows = [
        [one.name, str(one.rows), str(one.runs), number(one.stiffness_N_per_mm, span)]
        for one in found.specimens
    ]
    table = Table(titles, rows, frozenset(titles[1:]), page=_AT_ONCE)
    rest = len(rows) - _AT_ONCE
    words = "N/mm: of parallel straight lines through the runs, as read; a first look."
    words += f" {rest} more are not listed." * (rest > 0)
    return Section("The specimens", [table, Text(words, soft=True)], brief=True)


def _facts(found: CheckAnswer, lacking: bool) -> Iterator[tuple[str, str]]:
    data, gear = found.data, found.gear
    guessed = [note for note in found.notes if note.startswith(ASSUMED)]
    for note in guessed:
        yield "assumed", note.removeprefix(ASSUMED)
    for note in found.notes:
        if note not in guessed:
            yield "note", note
    yield "gear", f"{gear.name}, {gear.material}, theory {gear.theory}"
    yield "rows", str(data.rows)
    for what, labels in (("runs", data.runs), ("specimens", data.specimens)):
        if len(labels) > 1:
            rest = ", …" if len(labels) > _MOST_LISTED else ""
            yield what, f"{len(labels)}: {', '.join(labels[:_MOST_LISTED])}{rest}"
    way = f"{gear.deformation}, as read"
    yield "deformation", f"{_span(data.deformation_mm)} mm ({way})"
    yield "force", f"{_span(data.force_N)} N"
    for one in found.certificates:
        known = f"± {one.standard_uncertainty:.3g} {one.unit} (standard uncertainty)"
        yield one.parameter, f"{known}, {one.certificate}: {one.words}"
    measured = "" if data.temperature_measured else " (not measured: the reference)"
    yield "temperature", f"{_span(data.temperature_C)} °C{measured}"
    moves = vars(data.direction).items()
    yield "direction", ", ".join(f"{many} {word}" for word, many in moves if many)
    yield "also known", ", ".join(data.known) or "–"
    yield "effects to test", ", ".join(found.effects.testable)
    yield from _lacking(found, lacking)


def _lacking(found: CheckAnswer, each: bool) -> Iterator[tuple[str, str]]:
    """Yield what is needed to test the other effects, by effect or at once."""
    lacking = found.effects.not_testable
    if each:
        for name, lack in lacking.items():
            yield "not testable", f"{name}: needs {', '.join(lack)}"
    elif lacking:
        needs = dict.fromkeys(need for lack in lacking.values() for need in lack)
        yield (
            "not testable",
            f"{len(lacking)} effects, for want of {', '.join(needs)}",
        )


def _span(ends: Ends) -> str:
    low, high = (f"{end:g}" for end in ends)
    return low if low == high else f"{low} … {high}"
