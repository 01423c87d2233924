"""What gears have in common as an answer, and all that its result folder holds."""

import shlex
from collections.abc import Iterator

import numpy as np

from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.diagnosis.naming import naming
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.fleets.left_out import left_out_of, with_left_out
from hdcal.physics.registry import EFFECTS
from hdcal.report.intervals import INTERVAL, credible_interval
from hdcal.report.words import capital, label, percent
from hdcal.report.write import Report
from hdcal.shared_causes.answer import CausesAnswer, LotWithCauses, SharedCause
from hdcal.shared_causes.causes import TOLD, FleetCauses
from hdcal.shared_causes.document import causes_document, headline
from hdcal.versions import versions


def cause_columns(found: FleetCauses) -> dict[str, np.ndarray]:
    """Return what each gear may have, the columns of gears.csv."""
    names = np.array(found.causes)
    return {
        "gear": np.array(found.case.specimen_labels),
        **({"lot": np.array(found.case.lots)} if found.case.lots else {}),
        "rows": np.bincount(found.case.records.specimen),
        "causes": np.array([" / ".join(own) for own in found.of_gears]),
        "probability": found.chance.max(axis=1),
        "probability_none": found.chance[:, found.causes.index(NONE)],
        "alone": names[found.alone.argmax(axis=1)],
        "probability_alone": found.alone.max(axis=1),
        "status": np.full(len(found.chance), "failed" if found.reasons else "ok"),
    }


def causes_answer(found: FleetCauses) -> CausesAnswer:
    """Return it as an answer, ready for JSON."""
    failed = f"This result failed its checks: {'; '.join(found.reasons)}."
    labels, of_gears = found.case.specimen_labels, found.of_gears
    order = np.argsort(-found.share.mean(axis=0), kind="stable")
    return CausesAnswer(
        status="failed" if found.reasons else "ok",
        reasons=found.reasons,
        headline=failed if found.reasons else headline(labels, of_gears),
        next_step=None if found.reasons else _next_step(found),
        gears=len(labels),
        rows=len(found.case.records.force),
        left_out=left_out_of(found.case),
        causes=tuple(_shared_cause(found, int(place)) for place in order),
        lots=tuple(_lots(found)),
        not_shown=tuple(n for n in found.library if n not in found.causes),
        interval=INTERVAL,
        notes=tuple(_notes(found)),
        seed=found.seed,
        versions=versions(),
        data_sha256=found.case.data_sha256,
    )


def _shared_cause(found: FleetCauses, place: int) -> SharedCause:
    name = found.causes[place]
    return SharedCause(
        cause=name,
        gears_told=sum(own == (name,) for own in found.of_gears),
        gears=credible_interval(np.sum(found.cause == place, axis=1)),
        share=credible_interval(found.share[:, place]),
        log_evidence_nat=float(found.log_evidence[:, place].sum()),
        name_tested=naming().may_be_named(name) if name in EFFECTS else None,
    )


def _lots(found: FleetCauses) -> Iterator[LotWithCauses]:
    lots, something = np.array(found.case.lots), found.cause != found.causes.index(NONE)
    for lot in sorted({*found.case.lots}):
        own = lots == lot
        many = credible_interval(np.sum(something[:, own], axis=1))
        yield LotWithCauses(lot, int(own.sum()), many)


def _next_step(found: FleetCauses) -> str | None:
    """Return whom to look at: the gear that most surely has something."""
    nothing = found.chance[:, found.causes.index(NONE)]
    odd = int(np.argmin(nothing))
    if nothing[odd] > 1.0 - TOLD:
        return None
    gear = found.case.specimen_labels[odd]
    alone = f"`--specimen {shlex.quote(gear)}`"
    return f"See its size and where it lies: diagnose {gear} alone with {alone}."


def _notes(found: FleetCauses) -> Iterator[str]:
    left_out, many = found.case.left_out, len(found.case.specimen_labels)
    if left_out:
        yield left_out_words(left_out, many + len(left_out))
    yield from found.case.notes
    told = {own[0] for own in found.of_gears if len({*own} - {UNKNOWN}) == 1}
    counted = naming().called
    for name in sorted(told & counted.keys()):
        yield (
            f"{capital(label(name))} describes these gears best. In blind checks "
            f"{percent(counted[name].rate)} of what it described best was something "
            "else; that many gears look alike makes the name no surer."
        )
    for name in sorted(found.left_open):
        yield (
            f"Beside {label(name)} something unknown is left open: one gear by "
            "itself does not tell them apart, and it would look the same in all."
        )
    hidden = [label(n) for n in found.library if n not in found.causes]
    if hidden:
        yield f"No gear was read so that these would show: {', '.join(hidden)}."


def causes_report(found: FleetCauses, command: str = "") -> Report[CausesAnswer]:
    """Return all that `hdcal causes` leaves behind.

    Args:
        found: what gears have in common.
        command: that made it.
    """

    def figures():
        from hdcal.shared_causes.figure import causes_figure

        return {"causes": causes_figure(found)}

    def charts():
        from hdcal.shared_causes.chart import causes_chart

        return {} if found.reasons else {"causes": [causes_chart(found)]}

    answer, columns = causes_answer(found), cause_columns(found)
    return Report(
        causes_document(found, answer, columns, command),
        answer,
        "summary.json",
        figures,
        tables=lambda: {"gears.csv": with_left_out(columns, found.case)},
        charts=charts,
        theory=found.case.gear.theory,
    )
