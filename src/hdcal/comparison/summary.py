"""A comparison as an answer, in words, and all that its result folder holds."""

from collections.abc import Iterator

import numpy as np

from hdcal.comparison.answer import Compared, ComparisonAnswer
from hdcal.comparison.compare import Comparison
from hdcal.data.versions import versions
from hdcal.report.document import Document, Picture, Section, Table, Text, notices
from hdcal.report.parameters import INTERVAL, Interval, credible_interval
from hdcal.report.words import estimate, percent
from hdcal.report.write import Report

_MOST_NAMED = 3


def comparison_answer(found: Comparison) -> ComparisonAnswer:
    """Return a comparison as an answer, ready for JSON."""
    results = tuple(_compared(found, place) for place in range(len(found.names)))
    return ComparisonAnswer(
        status="ok",
        reasons=(),
        headline=_headline(results),
        next_step=None,
        results=results,
        tolerance_N_per_mm=found.tolerance,
        interval=INTERVAL,
        notes=found.notes,
        seed=found.seed,
        versions=versions(),
    )


def _compared(found: Comparison, place: int) -> Compared:
    apart, first = found.difference[place], found.stiffness[0]
    differs = None
    if found.tolerance is not None:
        differs = float(np.mean(np.abs(apart) > found.tolerance))
    return Compared(
        name=found.names[place],
        rows=int(found.rows[place]),
        stiffness_N_per_mm=credible_interval(found.stiffness[place]),
        difference_N_per_mm=credible_interval(apart),
        difference_percent=credible_interval(100.0 * apart / first),
        probability_stiffer=float(np.mean(apart > 0.0)) if place else 0.5,
        probability_differs=differs,
    )


def _headline(results: tuple[Compared, ...]) -> str:
    first, *others = results
    apart = [one for one in others if not _holds_zero(one.difference_percent)]
    apart.sort(key=lambda one: -abs(one.difference_percent.median))
    told = [_said(one, first) for one in apart[:_MOST_NAMED]]
    if len(apart) > _MOST_NAMED:
        told.append(f"{len(apart) - _MOST_NAMED} more differ from it")
    alike = [one for one in others if one not in apart]
    if alike and len(alike) <= _MOST_NAMED:
        told += [_alike(one, first) for one in alike]
    elif alike:
        told.append(f"{len(alike)} cannot be told apart from {first.name}")
    return "; ".join(told) + "."


def _holds_zero(span: Interval) -> bool:
    return span.lo <= 0.0 <= span.hi


def _said(one: Compared, first: Compared) -> str:
    middle, span = estimate(_size(one.difference_percent))
    word = "stiffer" if one.difference_percent.median > 0.0 else "softer"
    return f"{one.name} is {middle} % {word} than {first.name} (95 %: {span} %)"


def _size(span: Interval) -> Interval:
    if span.median > 0.0:
        return span
    return Interval(-span.median, -span.hi, -span.lo)


def _alike(one: Compared, first: Compared) -> str:
    span = estimate(one.difference_percent)[1]
    return f"{one.name} and {first.name} cannot be told apart (95 %: {span} %)"


def comparison_columns(found: Comparison) -> dict[str, np.ndarray]:
    """Return the table of a comparison, the columns of gears.csv."""
    results = comparison_answer(found).results
    columns = {
        "gear": np.array(found.names),
        "rows": found.rows,
    }
    for name, kind in (
        ("stiffness", "stiffness_N_per_mm"),
        ("difference", "difference_N_per_mm"),
        ("difference_percent", "difference_percent"),
    ):
        spans = [getattr(one, kind) for one in results]
        columns[kind] = np.array([span.median for span in spans])
        columns[f"{name}_lo"] = np.array([span.lo for span in spans])
        columns[f"{name}_hi"] = np.array([span.hi for span in spans])
    columns["probability_stiffer"] = np.array([r.probability_stiffer for r in results])
    if found.tolerance is not None:
        differs = [one.probability_differs for one in results]
        columns["probability_differs"] = np.array(differs)
    return columns


def comparison_report(found: Comparison, command: str = "") -> Report[ComparisonAnswer]:
    """Return all that `hdcal compare` leaves behind."""

    def figures():
        from hdcal.comparison.figure import comparison_figure

        return {"results": comparison_figure(found)}

    def charts():
        from hdcal.comparison.chart import comparison_chart

        return {"results": [comparison_chart(found)]}

    answer = comparison_answer(found)
    return Report(
        _document(answer, command),
        answer,
        "summary.json",
        figures,
        tables=lambda: {"gears.csv": comparison_columns(found)},
        charts=charts,
    )


def _document(answer: ComparisonAnswer, command: str) -> Document:
    told = ", ".join(f"{k} {v}" for k, v in answer.versions.items())
    provenance = [("seed", str(answer.seed)), ("versions", told)]
    caption = "Stiffness as read of every result with its 95 % credible interval."
    picture = Picture("results", "Stiffness of every result", caption)
    heading = f"Compared with {answer.results[0].name}"
    table, note = _table(answer), Text("The numbers are in gears.csv.", soft=True)
    return Document(
        name=" and ".join(one.name for one in answer.results[:2])
        + (f" and {len(answer.results) - 2} more" if len(answer.results) > 2 else ""),
        kind="comparison",
        subtitle=f"{len(answer.results)} results side by side",
        headline=answer.headline,
        answers=list(_answers(answer)),
        notices=notices(("To be aware of", answer.notes)),
        sections=[Section(heading, [picture, table, note], brief=True)],
        provenance=provenance + ([("command", command)] if command else []),
    )


def _answers(answer: ComparisonAnswer) -> Iterator[str]:
    first, *others = answer.results
    tolerance = answer.tolerance_N_per_mm
    if tolerance is None:
        return
    told = [
        f"{one.name} with {percent(one.probability_differs)}"
        for one in others[:_MOST_NAMED]
    ]
    rest = "; all are in the table" if len(others) > _MOST_NAMED else ""
    yield (
        f"From {first.name} differs by more than {tolerance:g} N/mm: "
        f"{', '.join(told)} probability{rest}."
    )


def _table(answer: ComparisonAnswer) -> Table:
    numbers = ["rows", "N/mm", "95 % interval", "difference [%]", "of it 95 %"]
    numbers += ["P(stiffer)"]
    tolerance = answer.tolerance_N_per_mm
    numbers += [f"P(apart > {tolerance:g} N/mm)"] if tolerance is not None else []
    rows = []
    for place, one in enumerate(answer.results):
        row = [one.name, str(one.rows), *estimate(one.stiffness_N_per_mm)]
        row += list(estimate(one.difference_percent)) if place else ["", ""]
        row += [percent(one.probability_stiffer) if place else ""]
        if tolerance is not None:
            row += [percent(one.probability_differs) if place else ""]
        rows.append(row)
    return Table(["result", *numbers], rows, frozenset(numbers), page=25)
