"""The closing words about a gear that moves, for a person at a terminal."""

from collections.abc import Iterator

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from hdcal.motion.document import QUANTITIES, quantity_rows
from hdcal.report.paragraph import paragraph
from hdcal.report.plain import harmless
from hdcal.report.words import estimate


def motion_words(summary: dict, folder: str) -> Iterator[RenderableType]:
    """Yield what a dynamic calibration found.

    Args:
        summary: of the calibration.
        folder: where the result lies.
    """
    summary = harmless(summary)
    name, rows = summary["gear"]["name"], summary["data"]["rows"]
    yield Text(f"{name}: {rows} rows over time", "bold")
    if summary["status"] != "ok":
        yield Text("FAILED: this result must not be used.", "bold red")
        for reason in summary["reasons"]:
            yield Padding(Text(reason, "red"), (0, 0, 0, 2))
    else:
        middle, span = estimate(summary["natural_frequency_Hz"])
        yield Text(
            f"The gear swings freely at {middle} Hz, 95 % credible interval {span} Hz"
        )
    entries = {name: summary[name] for name in QUANTITIES if name in summary}
    entries["mass_kg"] = summary["parameters"]["mass"]
    yield _table(entries, drivers=False)
    yield from paragraph("Remarks", summary["flat_directions"])
    yield from paragraph("Warnings", summary["warnings"], "yellow")
    yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")


def response_words(summary: dict, folder: str) -> Iterator[RenderableType]:
    """Yield how the gear moves.

    Args:
        summary: of the response.
        folder: where the result lies.
    """
    summary = harmless(summary)
    yield Text(f"{summary['gear']}: {summary['force']}", "bold")
    middle, span = estimate(summary["estimates"]["peak_mm"])
    yield Text(f"The deformation reaches {middle} mm, 95 % credible interval {span} mm")
    yield _table(summary["estimates"], drivers=True)
    yield from paragraph("Remarks", summary["remarks"], "yellow")
    yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")


def _table(entries: dict, *, drivers: bool) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("quantity")
    for heading in ("median", "95 % interval"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    if drivers:
        table.add_column("decided by")
    for row in quantity_rows(entries):
        cells = [row["label"], row["median"], row["span"], row["unit"]]
        colour = {"prior": "yellow", "data": "green"}.get(row["driven_by"], "")
        last = [Text(row["driven_by"], colour)] if drivers else []
        table.add_row(*map(Text, cells), *last)
    return table
