"""The closing words of an opened blind check, for a person at a terminal."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.words import bar_row, measured_row
from hdcal.report.plain import harmless

_COLOURS = {"passed": "green", "failed-tag": "red", "note": "dim"}
_KINDS = {"null": "without a gap", "pair": "with two effects", "real": "measured"}


def opening_words(
    scores: dict[str, Any],
    labels: Sequence[Label],
    answers: Mapping[str, Sequence[CaseAnswer]],
    folder: str,
) -> Iterator[RenderableType]:
    """Yield every row of the bar, and what was said of measured data.

    Args:
        scores: from `hdcal.blind.scoring.scores.score`.
        labels: the truth.
        answers: by diagnoser, in the order of the labels.
        folder: where the result lies.
    """
    kinds = scores["cases"]["kinds"]
    listed = ", ".join(f"{n} {_KINDS.get(kind, kind)}" for kind, n in kinds.items())
    words = f"Cases: {listed}; answers of '{scores['diagnoser']}'"
    yield Text(f"\n{harmless(words)}", "bold")
    if set(kinds) - {"real"}:
        yield _bar(scores["bar"])
        count = scores["summary"]
        rest = f"{count['open']} have no target or no cases"
        yield Text(f"{count['met']} met, {count['missed']} missed; {rest}")
    if "real" in kinds:
        yield _measured(labels, answers)
        yield Text("The cause of measured data is what was stated when it was sealed.")
    yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")


def _bar(rows: list[dict]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("what")
    for heading in ("found", "95 % interval", "cases", "target"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    for row in map(bar_row, rows):
        cells = (row[key] for key in ("what", "value", "span", "n", "target"))
        table.add_row(*cells, Text(row["word"], _COLOURS[row["tag"]]))
    return table


def _measured(
    labels: Sequence[Label], answers: Mapping[str, Sequence[CaseAnswer]]
) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("by", "stated", "verdict", "set", "holds it"):
        table.add_column(heading)
    for name, said in answers.items():
        for label, answer in zip(labels, said, strict=True):
            if label.kind == "real":
                row = harmless(measured_row(label, answer))
                cells = (row[key] for key in ("stated", "word", "set", "holds"))
                table.add_row(*map(Text, (harmless(name), *cells)))
    return table
