"""The report of a diagnosis; the sentences of its answer are in `words`."""

from collections.abc import Iterator, Sequence

from hdcal.calibration.summary import summarise
from hdcal.data.case import Case
from hdcal.diagnosis.answer import CellAnswer, VerdictAnswer, VerdictsAnswer
from hdcal.diagnosis.verdict import Gap, Shrink
from hdcal.diagnosis.words import held_out, one_reading, verdict_word
from hdcal.inference.posterior import Posterior
from hdcal.report.document import (
    Block,
    Document,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    Tag,
    Text,
)
from hdcal.report.page import parameter_row
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.words import (
    estimate,
    hypothesis,
    known,
    likely,
    newton,
    number,
    or_zero,
    percent,
    percent_span,
)

_MOST_ROWS = 12
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
            _where(found),
            _which(found),
            _shrink(found.shrink),
            _next_runs(found),
            _budget(found),
            _corrected(found, refit),
            Section("What this cannot say", [Sentences(found.limits)], brief=True),
            *([Section("Remarks", [Sentences(found.notes)], True)] * bool(found.notes)),
            *([] if case is None else [Section("Data", [Facts(data_rows(case))])]),
        ],
        provenance=[] if case is None else _provenance(case, found, command),
        failed=found.reasons,
        failed_words=_FAILED,
    )


def overview_document(found: VerdictsAnswer) -> Document:
    """Return one table with a row for each of many cases."""
    numbers = ("probability", "gap", "closed")
    rows = [_overview_row(name, one) for name, one in found.cases.items()]
    table = Table(["case", "verdict", "cause", *numbers], rows, frozenset(numbers))
    return Document(
        name=f"{len(rows)} cases",
        kind="diagnoses",
        subtitle="diagnosed one by one",
        headline=f"{found.headline}.",
        sections=[Section("Verdicts", [table], brief=True)],
    )


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
        newton(size) if known(size) else "–",
        "–" if closed is None else percent(closed.median),
    ]


def _where(found: VerdictAnswer) -> Section:
    facts = Table(["", "found", "meaning"], _gap_rows(found), frozenset({"found"}))
    caption = (
        "Bars: mean of measured minus calibrated force in ranges chosen before "
        "looking. Blue shade: how far noise alone would move them, in 95 % of all "
        "programs for all ranges together. Red on amber: off. Thin line: the gap. In "
        "the running sums noise stays in the grey band, a gap keeps its course."
    )
    shows = "Measured minus calibrated force over everything that was measured"
    picture = Picture("where", shows, caption, tall=True)
    shares = ", ".join(
        f"{percent_span(each.share)} with {each.covariate}"
        for each in found.where.shares
    )
    varies = [Text(f"The gap varies {shares}.")] if shares else []
    regions = _regions(found.where.regions)
    return Section("Where the gap lies", [facts, picture, *regions, *varies])


def _gap_rows(found: VerdictAnswer) -> list[tuple[str, str, str]]:
    gap, p = found.gap, found.where.p_value
    chance = f"p = {number(p)}"
    words = "a gap is seen" if gap.detected else "no gap is seen"
    seen = ("seen", chance, f"{words}; how often noise alone looks like this")
    if known(gap.rounding_N):
        steps = f"in steps of {newton(gap.rounding_N)}"
        seen = ("seen", "rounding", f"{steps}; nothing else is seen ({chance})")
    noise = f"standard deviation of {one_reading(found)}"
    return [
        seen,
        ("probability", percent(gap.probability), "that anything is missing"),
        *_size_rows(gap),
        ("noise", newton(gap.noise_sd_N), noise),
    ]


def _size_rows(gap: Gap) -> list[tuple[str, str, str]]:
    if not known(gap.rms_N.median):
        return [("size", "–", "of what is not seen there is no size")]
    middle, span = estimate(gap.rms_N)
    share = percent(gap.share_of_full_scale)
    return [
        ("size", f"{middle} N", f"root mean square; 90 % interval {span} N"),
        ("of full scale", share, "size over the largest force tested"),
    ]


def _regions(regions: Sequence[CellAnswer]) -> Iterator[Block]:
    if not regions:
        yield Text("No range is off by more than noise alone would make it.")
        return
    numbers = ("rows", "measured − model [N]", "in standard errors", "share of the gap")
    rows = [_region_row(cell) for cell in regions[:_MOST_ROWS]]
    yield Table(["off", "in", *numbers], rows, frozenset(numbers))
    hidden = len(regions) - _MOST_ROWS
    if hidden > 0:
        yield Text(f"{hidden} more are in verdict.json.", soft=True)


def _region_row(cell: CellAnswer) -> list[str]:
    bias = cell.bias_N
    width = bias.hi - bias.lo if known(bias.hi) else None
    return [
        cell.covariate,
        cell.label,
        str(cell.rows),
        number(bias.median, width),
        number(cell.z, 10.0),
        percent(cell.share),
    ]


def _which(found: VerdictAnswer) -> Section:
    which = found.which
    chances, evidence = which.probabilities, which.log_evidence
    together = likely(chances)
    ranked = sorted(chances, key=lambda name: -or_zero(chances[name]))[:_MOST_ROWS]
    rows = [
        [hypothesis(name), percent(chances[name]), number(evidence.get(name), 10.0)]
        for name in ranked
    ]
    numbers = ("probability", "log evidence over no gap")
    strong = frozenset(i for i, name in enumerate(ranked) if name in together)
    table = Table(["hypothesis", *numbers], rows, frozenset(numbers), strong=strong)
    others = len(chances) - _MOST_ROWS
    rest = f"{others} less probable ones are in verdict.json. " if others > 0 else ""
    note = (
        f"Bold: the fewest that make up 90 %. {rest}Log evidence in nats: three are a "
        "factor of twenty."
    )
    caption = (
        "Every hypothesis was weighed against the same data. “Something outside the "
        "library” is a free shape; it wins where no effect fits."
    )
    picture = Picture("which", "Probability of each hypothesis", caption)
    robust = list(_robustness(found))
    more = [Sentences(robust)] if robust else []
    blocks = [picture, table, Text(note, soft=True), *more]
    return Section("Which effect causes it", blocks)


def _robustness(found: VerdictAnswer) -> Iterator[str]:
    which = found.which
    if which.sensitivity:
        texts = [
            f"{percent(value)} ({name.replace('_', ' ')})"
            for name, value in which.sensitivity.items()
        ]
        yield (
            "With other beliefs about the size of effects, the first cause would have "
            f"{', '.join(texts)}."
        )
    if known(which.stability):
        share = percent(which.stability)
        yield f"With other readings of the same kind, the ranking's top stays: {share}."


def _shrink(shrink: Shrink) -> Section:
    caption = (
        "Left: what each model leaves over (root mean square). Right: how much of the "
        "gap is closed on readings that were not used in fitting. A free curve with as "
        "many parameters is the placebo: an effect should do better, above all where "
        "the largest deformations are held out."
    )
    shows = (
        "Root mean square of measured minus model, from the nominal model to the noise"
    )
    picture = Picture("shrink", shows, caption)
    closed = (
        Text(f"Not computed: {shrink.reason}.")
        if shrink.closed is None
        else Facts(list(_closed_rows(shrink)))
    )
    return Section("How far the gap shrinks", [picture, closed])


def _closed_rows(shrink: Shrink) -> Iterator[tuple[str, str]]:
    if shrink.closed is not None:
        yield f"closed on {held_out(shrink)}", percent_span(shrink.closed)
    if known(shrink.extrapolated_closed):
        share = percent(shrink.extrapolated_closed)
        yield "with the largest deformations held out", share
    if known(shrink.placebo_closed):
        share = percent(shrink.placebo_closed)
        yield "by a free curve instead (placebo)", share
    for name, share in shrink.bars.items():
        yield f"by {hypothesis(name)}", percent(share)
    if shrink.remainder_N is not None:
        middle, span = estimate(shrink.remainder_N)
        yield "left after it", f"{middle} N, 90 % interval {span} N"


def _next_runs(found: VerdictAnswer) -> Section:
    heading = "Runs that would tell more, if the cause is in the library"
    if not found.next_test:
        return Section(
            heading, [Text(f"No run is proposed: {found.next_test_reason}.")]
        )
    rows = [
        [
            run.run,
            ", ".join(map(hypothesis, run.separates)),
            number(run.information_nats, 1.0),
            run.cost,
        ]
        for run in found.next_test
    ]
    columns = ["run", "tells apart", "information [nat]", "cost"]
    note = (
        "“Something outside the library” predicts nothing and is left out of this "
        "ranking."
    )
    table = Table(columns, rows, frozenset({"information [nat]"}))
    return Section(heading, [table, Text(note, soft=True)], brief=True)


def _budget(found: VerdictAnswer) -> Section:
    budget = found.budget
    middle, span = estimate(budget.K)
    words = (
        f"K by the {budget.formula} formula, at the prior's mean modulus, is {middle}, "
        f"90 % interval {span}. {budget.note}"
    )
    rows = [
        [
            part.name,
            *estimate(part.factor),
            " : ".join(estimate(part.prior)),
            Tag(part.driven_by, "good" if part.driven_by == "data" else "caution"),
            part.split_by,
        ]
        for part in budget.parts
    ]
    numbers = ("factor", "90 % interval", "before the data")
    columns = ["part of K", *numbers, "driven by", "what would tell it"]
    table = [Table(columns, rows, frozenset(numbers))] if rows else []
    return Section("Why K is not 1", [Text(words), *table])


def _corrected(found: VerdictAnswer, refit: tuple[str, Posterior] | None) -> Section:
    heading = "The corrected model"
    if refit is None:
        why = ": the diagnosis was quick" if found.quick else ""
        return Section(heading, [Text(f"None was sampled{why}.")])
    name, posterior = refit
    bad = "" if posterior.usable else " This fit failed its checks; do not use it."
    words = (
        f"Calibrated again with {hypothesis(name)}. All draws are in posterior.nc, the "
        f"numbers of the bands in bands.csv.{bad}"
    )
    caption = (
        "Dark band: where the corrected model lies with 95 % probability. Light band: "
        "where one new reading lies with 95 % probability. Hatched and dotted: outside "
        "what was tested."
    )
    shows = "Measured force over deformation with the bands of the corrected model"
    note = "Intervals hold 95 % of the posterior, with equal tails."
    blocks = [
        Text(words),
        Picture("bands", shows, caption),
        _parameters(posterior),
        Text(note, soft=True),
    ]
    return Section(heading, blocks)


def _parameters(posterior: Posterior) -> Table:
    rows = []
    for name, entry in summarise(posterior)["parameters"].items():
        r = parameter_row(name, entry)
        tone = "good" if r["driven_by"] == "data" else "caution"
        rows.append(
            [
                r["label"],
                r["median"],
                r["span"],
                r["unit"],
                Tag(r["driven_by"], tone),
                r["contraction"],
                r["rhat"],
                " / ".join(r["ess"]),
            ]
        )
    numbers = (
        "median",
        "95 % interval",
        "gained from data",
        "R-hat",
        "ESS bulk / tail",
    )
    return Table(
        [
            "parameter",
            "median",
            "95 % interval",
            "unit",
            "driven by",
            "gained from data",
            "R-hat",
            "ESS bulk / tail",
        ],
        rows,
        frozenset(numbers),
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
