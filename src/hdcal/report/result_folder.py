"""The folder of a result: page, JSON, charts, tables and other files."""

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING

from hdcal.report.charts.chart_drawing import images
from hdcal.report.page import html_page
from hdcal.report.result import Result
from hdcal.report.table_files import columns_csv

if TYPE_CHECKING:
    import pandas as pd

    from hdcal.report.saving import Target


def write_result(
    result: Result,
    target: "Target",
    *,
    command: str = "",
    answer: str = "summary.json",
    figures: Collection[str] | None = None,
    tables: "Mapping[str, pd.DataFrame] | None" = None,
    others: Mapping[str, Callable[[], bytes]] | None = None,
) -> None:
    """Write a result folder, whole or not at all.

    `answer` is the name of the JSON file, `figures` name the charts that are files too
    (by default all), `tables` are by the names of their CSV files, `others` make the
    content of other files.
    """
    contents = {answer: result.to_json().encode()}
    contents |= page_files(result, command, figures)
    for name, table in (tables or {}).items():
        contents[name] = columns_csv(dict(table)).encode()
    for name, make in (others or {}).items():
        contents[name] = make()
    with target.filled() as folder:
        for name, content in contents.items():
            (folder / name).write_bytes(content)


def page_files(
    result: Result, command: str = "", figures: Collection[str] | None = None
) -> dict[str, bytes]:
    """Return report.html and the images of charts by file name; as `write_result`."""
    charts = result.charts()
    kept = charts if figures is None else figures
    drawn = {
        name: images(chart, name, ("svg", "png") if name in kept else ("svg",))
        for name, chart in charts.items()
    }
    page = html_page(result, command, {n: each["svg"] for n, each in drawn.items()})
    files = {"report.html": page.encode("utf-8", "xmlcharrefreplace")}
    for name in kept:
        files |= {f"{name}.{kind}": image for kind, image in drawn[name].items()}
    return files
