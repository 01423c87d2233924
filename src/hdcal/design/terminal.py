"""The closing words of a design or study, for a person at a terminal."""

from collections.abc import Iterator

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from hdcal.report.paragraph import paragraph
from hdcal.report.plain import harmless
from hdcal.report.words import estimate

# Rows of a study printed to a terminal; all are in study.csv.
_MOST_ROWS = 40


def closing_words(found: dict, folder: str) -> Iterator[RenderableType]:
    """Yield the answer, what it takes for granted, and where it lies.

    Args:
        found: a design or study as plain data, with its answer.
        folder: where the result lies.
    """
    found = harmless(found)
    if found["basis"] == "prior":
        yield Text("PRIOR ONLY: no gear was measured.", "bold yellow")
    for sentence in found["answer"]:
        yield Text(sentence)
    if "columns" in found:
        yield _table(found)
    yield Text("")
    if "population" in found:
        yield from paragraph("About", [found["population"]])
    yield from paragraph("Warnings", found["warnings"], "yellow")
    yield from paragraph("What this takes for granted", found["assumptions"])
    yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")


def _table(found: dict) -> Table:
    columns = found["columns"]
    varied = found["varied"] or ["deformation_mm"]
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in varied:
        table.add_column(name, justify="left" if name == "material" else "right")
    for heading in ("force [N]", f"{100 * found['interval']:g} % band [N]"):
        table.add_column(heading, justify="right")
    count = len(columns["force_median_N"])
    for i in range(min(count, _MOST_ROWS)):
        force = {k: columns[f"force_{k}_N"][i] for k in ("median", "lo", "hi")}
        cells = [columns[name][i] for name in varied]
        texts = [c if isinstance(c, str) else f"{c:.6g}" for c in cells]
        table.add_row(*map(Text, texts), *estimate(force))
    if count > _MOST_ROWS:
        table.caption = f"the first {_MOST_ROWS} of {count}; all are in study.csv"
    return table


def article_words(found: dict) -> Iterator[RenderableType]:
    """Yield the article's tables 3 and 4 beside what holds together.

    Args:
        found: from `summarise_article`.
    """
    for which in (3, 4):
        rows = [row for row in found["rows"] if row["table"] == which]
        yield Text(f"Table {which} of the article, forces in N", "bold")
        yield _article_table(rows)
    yield Text(
        "original, revised: as printed. article: its slope 1625.19 N/mm scaled by "
        "δ³/R³, and times 0.13. ring: the series divides, the length counts, K = 1. "
        "Rows 0.7 and 0.9 mm lie beyond what the article measured, 0.54 mm."
    )


def _article_table(rows: list[dict]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    # In Table 3 the deformation changes, in Table 4 the sizes.
    sizes = {"deformation_mm": "ω [mm]"}
    if rows[0]["table"] == 4:
        sizes = {"wall_thickness_mm": "δ [mm]", "radius_mm": "R [mm]"}
    forces = ("original_N", "revised_N", "measured_N")
    forces += ("article_N", "article_revised_N", "ring_N")
    for name in sizes.values():
        table.add_column(name, justify="right")
    for name in forces:
        table.add_column(name.removesuffix("_N").replace("_", " "), justify="right")
    calibrated = rows[0]["calibrated_N"] is not None
    if calibrated:
        table.add_column("calibrated", justify="right")
        table.add_column("95 % credible", justify="right", no_wrap=True)
    for row in rows:
        cells = [f"{row[name]:g}" for name in sizes]
        cells += ["–" if row[n] is None else f"{row[n]:.2f}" for n in forces]
        if calibrated:
            cells += list(estimate(row["calibrated_N"]))
        table.add_row(*map(Text, cells))
    return table
