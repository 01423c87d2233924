"""The report of a diagnosis; the sentences of its answer are in `words`."""

from collections.abc import Iterator

from hdcal.data.case import Case
from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.sections import (
    seen_section,
    shrink_section,
    where_section,
    which_section,
)
from hdcal.diagnosis.words import nothing_suspected
from hdcal.evidence.case_evidence import UNKNOWN
from hdcal.inference.posterior import Posterior
from hdcal.report.document import (
    Document,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
)
from hdcal.report.parameters import measured, parameter_estimates
from hdcal.report.posterior_sections import (
    PARAMETER_NOTE,
    driver_tag,
    parameter_table,
)
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.words import (
    estimate,
    hypothesis,
    label,
    number,
    percent,
)

_CORRECTED = "The corrected model"
_FAILED = (
    "The diagnosis did not pass its checks, so it gives no answer, and every number "
    "and figure on this page may be wrong."
)


def verdict_document(
    found: VerdictAnswer,
    case: Case | None = None,
    command: str = "",
    refit: tuple[str, Posterior] | None = None,
) -> Document:
    """Return the report; its pictures are where, which, shrink and, refitted, bands.

    Args:
        found: from `verdict_answer`.
        case: that was diagnosed; without it the report does not describe the data.
        command: how the result was made.
        refit: hypothesis and posterior of the corrected model.
    """
    quick = ", quick: no margins were sampled" if found.quick else ""
    return Document(
        name=found.gear.name,
        kind="diagnosis",
        subtitle="Diagnosis of the gap between model and measurement from "
        f"{found.data.rows} readings ({found.data.name}), theory "
        f"“{found.gear.theory}”{quick}.",
        headline=found.headline,
        # The next run closes the answer in JSON; here it has a frame of its own.
        answers=found.answer[1 : len(found.answer) - (found.next_step is not None)],
        next_steps=[] if found.next_step is None else [found.next_step],
        sections=[
            seen_section(found),
            where_section(found),
            which_section(found),
            shrink_section(found.shrink, found.units),
            _next_runs(found),
            *_budget(found),
            _corrected(found, refit),
            Section("What this cannot say", [Sentences(found.limits)], brief=True),
            *(
                [Section("Remarks", [Sentences(found.notes)], True)]
                if found.notes
                else []
            ),
            *([] if case is None else [_data(case)]),
        ],
        provenance=[] if case is None else _provenance(case, found, command),
        failed=found.reasons,
        failed_words=_FAILED,
    )


def _data(case: Case) -> Section:
    return Section("Data", [Facts(data_rows(case))], appendix=True)


def _next_runs(found: VerdictAnswer) -> Section:
    heading = "Runs that would tell more, if the cause is in the library"
    if nothing_suspected(found):
        return Section(heading, [Text("None is proposed: no gap is seen.")])
    if not found.next_test:
        return Section(
            heading, [Text(f"No run is proposed: {found.next_test_reason}.")]
        )
    rows = [
        [
            run.run,
            " from ".join(map(hypothesis, run.separates)),
            number(run.information_nats, 1.0),
            run.cost,
        ]
        for run in found.next_test
    ]
    columns = ["run", "tells apart", "information [nat]", "cost"]
    note = (
        "What tells most for its effort comes first. Tells apart: the two of the "
        "likeliest hypotheses that the run parts best; the answer above need not name "
        "them. 0.7 nat is what an answer of yes or no tells. “Something outside the "
        "library” predicts nothing and is left out."
    )
    table = Table(columns, rows, frozenset({"information [nat]"}))
    return Section(heading, [table, Text(note, soft=True)], brief=True)


def _budget(found: VerdictAnswer) -> Iterator[Section]:
    budget = found.budget
    if budget is None:
        return
    middle, span = estimate(budget.K)
    words = (
        f"K by the {budget.formula} formula, at the prior's mean modulus, is {middle}, "
        f"95 % interval {span}. {_whose(found)}; a calibration with other effects, or "
        f"with none, gives another K. {budget.note}"
    )
    rows = [
        [
            part.name,
            *estimate(part.factor),
            " : ".join(estimate(part.prior)),
            driver_tag(part.driven_by),
            part.split_by,
        ]
        for part in budget.parts
    ]
    numbers = ("factor", "95 % interval", "before the data")
    columns = ["part of K", *numbers, "driven by", "what would tell it"]
    table = [Table(columns, rows, frozenset(numbers))] if rows else []
    yield Section("Why K is not 1", [Text(words), *table])


def _whose(found: VerdictAnswer) -> str:
    """Say which effects were in the model, or the models, of which K is."""
    if len(found.refits) > 1:
        return (
            f"It is the average over the {len(found.refits)} models under "
            f"“{_CORRECTED}”, each weighed by its probability"
        )
    if found.refits:
        return f"It is that of the model with {hypothesis(found.refits[0].hypothesis)}"
    names = found.which.named
    beside = " and ".join(map(label, names)) if names else "no effect"
    return f"It is fitted beside {beside}"


def _corrected(found: VerdictAnswer, refit: tuple[str, Posterior] | None) -> Section:
    heading = _CORRECTED
    if refit is None:
        why = ": the diagnosis was quick" if found.quick else ""
        return Section(heading, [Text(f"None was sampled{why}.")])
    name, posterior = refit
    bad = "" if posterior.usable else " This fit failed its checks; do not use it."
    words = f"Calibrated again with {hypothesis(name)}.{bad} {_kept(found)}"
    with_gap = any(UNKNOWN in one.hypothesis.split("+") for one in found.refits)
    gap = "; middle band: the same with the leftover discrepancy" * with_gap
    caption = (
        f"Inner band: where the corrected model lies with 95 % probability{gap}. Outer "
        "band: where one new reading lies with 95 % probability. Hatched and dotted: "
        "outside what was tested."
    )
    units = found.units
    shows = f"Measured {units.load} over {units.displacement} with the bands of the "
    shows += "corrected model"
    estimates = measured(parameter_estimates(posterior), posterior.theory)
    blocks = [
        Text(words),
        Picture("bands", shows, caption),
        parameter_table(estimates, units),
        PARAMETER_NOTE,
    ]
    return Section(heading, blocks)


def _kept(found: VerdictAnswer) -> str:
    """Say where the draws are, and what the bands average over."""
    numbers = "the numbers of the bands in bands.csv."
    if len(found.refits) < 2:
        return f"All draws are in posterior.nc, {numbers}"
    listed = ", ".join(
        f"{hypothesis(refit.hypothesis)} ({percent(refit.probability)})"
        for refit in found.refits
    )
    return (
        f"The bands average over {listed}. All draws are in posterior.nc, a group for "
        f"each of them, {numbers} Below, the most probable one."
    )


def _provenance(
    case: Case, found: VerdictAnswer, command: str
) -> list[tuple[str, str]]:
    rows = [
        *gear_rows(case, case.gear.theory),
        ("library", ", ".join(found.library)),
        ("seed", str(found.seed)),
        ("versions", ", ".join(f"{k} {v}" for k, v in found.versions.items())),
    ]
    return rows + ([("command", command)] if command else [])
