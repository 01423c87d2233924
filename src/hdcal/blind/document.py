"""The report of a blind check, from its scores."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring.estimates import Estimate
from hdcal.blind.scoring.file_order import FileOrder, NeighbourTests
from hdcal.blind.scoring.reliability import Reliabilities
from hdcal.blind.scoring.scores import Scores
from hdcal.blind.words import (
    bar_row,
    limit_row,
    measured_row,
    shown,
    span,
    truth_word,
    with_span,
)
from hdcal.report.document import (
    Block,
    Details,
    Document,
    Facts,
    Picture,
    Section,
    Table,
    Text,
    notices,
)

_TITLE = "Blind check"
_KINDS = {"null": "without a gap", "pair": "with two effects", "real": "measured"}
# key, heading and unit of the numbers in the tables of groups
_FIRST = (
    ("top1", "true effect first", "share"),
    ("oracle", "oracle", "share"),
    ("family", "true family first", "share"),
    ("set_holds", "set holds it", "share"),
    ("set_size", "size of set", "effects"),
    ("detected", "detected", "share"),
    ("false_alarms", "false alarms", "share"),
    ("precision", "names right", "share"),
    ("log_score", "log score [nat]", "nat"),
)
_SIZES = (
    ("amplitude", "error of amplitude", "share"),
    ("amplitude_holds", "interval holds it", "share"),
    ("gap", "error of gap", "share"),
    ("gap_holds", "interval holds it", "share"),
    ("closed", "error of closed share", "points"),
)
_RIVALS = (
    ("top1_r1", "true effect first, r = 1", "share"),
    ("top1_r0.5", "r = 0.5", "share"),
    ("top1", "all r", "share"),
    ("false_alarms", "false alarms", "share"),
    ("precision", "names right", "share"),
    ("log_score", "log score [nat]", "nat"),
    ("brier", "Brier score", "nat"),
)
_PAIRS = (
    ("pair_first", "the pair is the most probable hypothesis"),
    ("both_in_set", "both are in the 90 % set"),
    ("both_named", "both are named"),
    ("one_named_wrong", "an effect is named that does not act"),
)


def scores_document(
    found: Scores,
    labels: Sequence[Label] = (),
    answers: Mapping[str, Sequence[CaseAnswer]] | None = None,
) -> Document:
    """Return the report; its pictures: bar, confusion, reliability and detection.

    Args:
        found: from `hdcal.blind.scoring.scores.score`.
        labels: the truth, where what was said of measured data is to be shown.
        answers: by diagnoser, in the order of the labels.
    """
    kinds, count = found.cases.kinds, found.summary
    listed = ", ".join(f"{n} {_KINDS.get(kind, kind)}" for kind, n in kinds.items())
    missed = [row.what for row in found.bar if row.met is False]
    groups = {
        "size of the gap": found.by_r,
        "program": found.by_program,
        "noise": found.by_noise,
        "effect": found.by_effect,
        "family": found.by_family,
    }
    notes = [(name.replace("_", " "), words) for name, words in found.notes.items()]
    return Document(
        name=_TITLE,
        kind="scores",
        subtitle=f"{found.diagnoser} on {found.cases.n} cases"
        + (f" ({listed})" if listed else "")
        + " whose truth was sealed until every answer was given.",
        headline=f"{count.met} met, {count.missed} missed of the rows that were "
        f"promised; {count.open} have no target or no cases.",
        notices=notices(("Missed", missed)),
        sections=[
            _promised(found, brief=bool(set(kinds) - {"real"})),
            *_measured(labels, answers or {}),
            _beside_others(found),
            _confused(found),
            _reliability(found),
            _detection(found),
            _sizes(found),
            *(
                Section(f"By {name}", [_grid(name, lines, _FIRST)])
                for name, lines in groups.items()
            ),
            Section("Order of the files", [Facts(_order(found.order))]),
            Section("How it was reckoned", [Facts(notes)]),
        ],
    )


def _sizes(found: Scores) -> Section:
    table = _grid("size of the gap", found.by_r, _SIZES)
    return Section("How near the sizes come", [table])


def _promised(found: Scores, brief: bool) -> Section:
    caption = (
        "Green: where the target is met. Dot: met. Red cross: missed. Grey diamond: no "
        "target. Line: 95 % interval; at the edge: beyond it. The same numbers stand "
        "in the table."
    )
    picture = Picture(
        "bar", "Every row with its interval against its target", caption, tall=True
    )
    numbers = ("found", "target", "95 % interval", "cases")
    table = Table(
        ["row", "", *numbers, "interval by"],
        [bar_row(row) for row in found.bar],
        frozenset(numbers),
        frozenset({"row"}),
    )
    note = (
        "“Not firmly”: the interval reaches across the target, so that other cases of "
        "the same kind could turn it."
    )
    blocks = [picture, table, Text(note, soft=True)]
    return Section("What was promised", blocks, brief=brief)


def _measured(
    labels: Sequence[Label], answers: Mapping[str, Sequence[CaseAnswer]]
) -> Iterator[Section]:
    rows = [
        [name, *measured_row(label, answer)]
        for name, said in answers.items()
        for label, answer in zip(labels, said, strict=True)
        if label.kind == "real"
    ]
    if rows:
        words = "The cause of measured data is what was stated when it was sealed."
        table = Table(["by", "stated", "verdict", "set", "holds it"], rows)
        yield Section("Measured data", [table, Text(words)], brief=True)


def _beside_others(found: Scores) -> Section:
    brier = found.brier
    lines = [{**row, "brier": brier.get(row["name"])} for row in found.rivals]
    note = (
        "The oracle knows the size of the gap, the noise and the rig, and that an "
        "effect acts: nobody can be right more often. Below each number: 95 % "
        "interval. Log score: 0 is perfect, −13.8 the worst; Brier score: 0 to 2."
    )
    blocks = [_grid("diagnoser", lines, _RIVALS), Text(note, soft=True)]
    return Section("Beside others", blocks)


def _confused(found: Scores) -> Section:
    caption = (
        "Cases by truth (row) and most probable answer (column); shade: share of the "
        "row. Framed: right."
    )
    shows = "Truth against the most probable answer"
    blocks: list[Block] = [Picture("confusion", shows, caption, tall=True)]
    rows = [
        [
            truth_word(row.truth),
            truth_word(row.answer),
            f"{row.n} of {row.of}",
        ]
        for row in found.mix_ups
    ]
    if rows:
        columns = ["truth", "answered", "cases"]
        long = frozenset({"truth", "answered"})
        blocks.append(Table(columns, rows, frozenset({"cases"}), long))
    pairs = [(words, with_span(found.pairs[key])) for key, words in _PAIRS]
    heading = f"Two effects at once ({found.pairs['n']} cases)"
    blocks.append(Details(heading, [Facts(pairs)], folded=False))
    return Section("Who is taken for whom", blocks)


def _reliability(found: Scores) -> Section:
    caption = (
        "Dots on the dashed line: what is stated with 70 % is true seven times in ten. "
        "Below it: too sure."
    )
    shows = "Stated probability against the share that was true"
    picture = Picture("reliability", shows, caption)
    facts = Facts(_calibration(found.reliability))
    return Section("Whether probabilities mean what they say", [picture, facts])


def _detection(found: Scores) -> Section:
    caption = (
        "Dots: fraction detected with 95 % interval. Curve and band: fitted. Dashed: "
        "where nine of ten are detected."
    )
    shows = "Fraction detected against the size of the gap, by effect"
    blocks: list[Block] = [Picture("detection", shows, caption, tall=True)]
    rows = [limit_row(curve) for curve in found.detection]
    if rows:
        numbers = ("cases", "r for 90 %", "95 % interval")
        long = frozenset({"effect"})
        blocks.append(Table(["effect", *numbers], rows, frozenset(numbers), long))
    return Section("From which size on a gap is detected", blocks)


def _grid(
    first: str, lines: Iterable[Mapping[str, Any]], columns: Sequence[tuple]
) -> Table:
    """Return numbers of groups of cases, each with its interval below it."""
    heads = [words for _, words, _ in columns]
    rows = [
        [
            line["name"].replace("_", " "),
            str(line["n"]),
            *(_cell(line[key], unit) for key, _, unit in columns),
        ]
        for line in lines
    ]
    titles = [first, "cases", *heads]
    return Table(titles, rows, frozenset(titles[1:]), frozenset({first}))


def _cell(entry: Estimate | None, unit: str) -> str:
    if entry is None or entry.value is None:
        return "–"
    ends = span(entry, unit)
    return shown(entry.value, unit) + (f"\n{ends}" if ends != "–" else "")


def _calibration(found: Reliabilities) -> list[tuple[str, str]]:
    rows = []
    for entry, words in (
        (found.top, "most probable hypothesis"),
        (found.effects, "single effects given 5 % or more"),
    ):
        floor = entry.floor
        rows.append((f"error, {words}", with_span(entry, "points")))
        rows.append((f"before debiasing, {words}", shown(entry.plug_in, "points")))
        texts = "–"
        if floor is not None:
            mean, high = shown(floor.mean, "points"), shown(floor.hi, "points")
            texts = f"{mean} on average, up to {high} in 95 % of such checks"
        rows.append((f"of a perfectly calibrated one, {words}", texts))
    each = [row.value for row in found.classwise if row.value is not None]
    average = sum(each) / len(each) if each else None
    rows.append(("mean over effects, all statements", shown(average, "points")))
    return rows


def _order(found: FileOrder) -> list[tuple[str, str]]:
    p_value = shown(found.p_value, "p")
    rows = [("p-value, that answers do not depend on order", p_value)]
    if isinstance(found, NeighbourTests):
        for entry, words in (
            (found.same_as_neighbour, "same answer as the next file"),
            (found.truth_of_neighbour, "answer is the truth of a neighbour"),
            (
                found.truth_itself,
                "same truth as the next file (how well it was shuffled)",
            ),
        ):
            texts = f"{entry.seen}, expected {entry.expected:.0f}"
            rows.append((words, f"{texts}, p = {shown(entry.p_value, 'p')}"))
    rows.append(("right in the first half", with_span(found.first_half_right)))
    rows.append(("right in the second half", with_span(found.second_half_right)))
    return rows
