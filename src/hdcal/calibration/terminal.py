"""The closing words of a calibration, for a person at a terminal."""

from collections.abc import Iterator

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from hdcal.report.paragraph import paragraph
from hdcal.report.plain import harmless
from hdcal.report.words import estimate, label, number, unit


def closing_words(summary: dict, folder: str) -> Iterator[RenderableType]:
    """Yield what was found, how sure it is, what is prior, and what to do next.

    Args:
        summary: of the calibration.
        folder: where the result lies.
    """
    summary = harmless(summary)
    yield from _status(summary)
    yield _parameters(summary)
    yield from paragraph("Remarks", summary["flat_directions"])
    yield from paragraph("Warnings", summary["warnings"], "yellow")
    yield from paragraph("What to do next", summary["next_steps"])
    yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")


def _status(summary: dict) -> Iterator[RenderableType]:
    middle, span = estimate(summary["stiffness_N_per_mm"])
    name, rows = summary["gear"]["name"], summary["data"]["rows"]
    yield Text(f"{name}: {rows} rows, theory {summary['gear']['theory']}", "bold")
    if summary["status"] != "ok":
        yield Text("FAILED: this result must not be used.", "bold red")
        for reason in summary["reasons"]:
            yield Padding(Text(reason, "red"), (0, 0, 0, 2))
        return
    yield Text(f"Stiffness {middle} N/mm, 95 % credible interval {span} N/mm")


def _parameters(summary: dict) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("parameter")
    for heading in ("median", "95 % interval"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    table.add_column("driven by")
    for heading in ("R-hat", "ESS"):
        table.add_column(heading, justify="right")
    for name, entry in summary["parameters"].items():
        middle, span = estimate(entry)
        rhat, draws = entry["rhat"], entry["ess_bulk"]
        by_data = entry["driven_by"] == "data"
        table.add_row(
            Text(label(name)),
            middle,
            span,
            Text(unit(entry["unit"])),
            Text(entry["driven_by"], "green" if by_data else "yellow"),
            "–" if rhat is None else f"{rhat:.3f}",
            "–" if draws is None else number(round(draws)),
        )
    return table
