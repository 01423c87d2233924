"""A report's files: the page, the JSON answer, the figures and the tables."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from hdcal.report.chart import Chart
from hdcal.report.chart_spec import Chart as ChartSpec
from hdcal.report.document import Document, answer_spoken_of, spoken_of
from hdcal.report.plain import as_json
from hdcal.report.saving import Target
from hdcal.report.table_files import columns_csv, columns_parquet

if TYPE_CHECKING:
    from hdcal.report.canvas import Figure

PAGE = "report.html"
A = TypeVar("A", covariant=True)
Tables = Mapping[str, Mapping[str, np.ndarray]]
Charts = Mapping[str, Sequence[Chart] | ChartSpec]


@dataclass(frozen=True)
class Report(Generic[A]):
    """All that is told of one result; what takes time is made when it is written.

    Attributes:
        document: in words.
        answer: in numbers, a dataclass for JSON.
        file: name of the answer in a result folder.
        figures: draws the document's pictures, by name.
        kept: figures that become files of their own too, as SVG and PNG; by default
            all of them.
        tables: makes the columns of tables, by the names of their files: .csv, or
            .parquet, which is written where pyarrow is installed.
        others: makes the content of other files, each with its name.
        charts: the document's pictures that can be touched, by name.
        theory: of the model; of a spring no gear need be meant.
    """

    document: Document
    answer: A
    file: str
    figures: Callable[[], Mapping[str, "Figure"]] = dict
    kept: Collection[str] | None = None
    tables: Callable[[], Tables] = dict
    others: Callable[[], Iterable[tuple[str, bytes]]] = tuple
    charts: Callable[[], Charts] = dict
    theory: str = ""

    def __post_init__(self):
        """Speak of a part where no gear need be meant."""
        document = spoken_of(self.document, self.theory)
        object.__setattr__(self, "document", document)
        answer = answer_spoken_of(self.answer, self.theory)
        object.__setattr__(self, "answer", answer)


def write_report(report: Report, target: Target) -> None:
    """Write a result folder, whole or not at all.

    Args:
        report: what to write.
        target: where.

    Raises:
        InputError: the target appeared or was edited; the result is beside it.
        NotWritable: the disk refused.
    """
    # Drawn before the folder is begun: what fails there touches no disk.
    files = report_files(
        report.document, report.figures(), report.kept, report.charts()
    )
    with target.filled() as folder:
        write_numbers(report, folder)
        write_files(files, folder)


def write_numbers(report: Report, folder: Path) -> None:
    """Write all of a report but page and figures into a folder that is there."""
    (folder / report.file).write_text(as_json(report.answer), "utf-8")
    for name, columns in report.tables().items():
        parquet = name.endswith(".parquet")
        content = columns_parquet(columns) if parquet else columns_csv(columns).encode()
        if content is not None:
            (folder / name).write_bytes(content)
    for name, content in report.others():
        (folder / name).write_bytes(content)


def write_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files by their names into a folder that is there."""
    for name, content in files.items():
        (folder / name).write_bytes(content)


def report_files(
    document: Document,
    figures: Mapping[str, "Figure"],
    kept: Collection[str] | None = None,
    charts: Charts | None = None,
) -> dict[str, bytes]:
    """Return the page and the pictures of a report by the names of their files.

    Args:
        document: the report.
        figures: of the document's pictures, by name.
        kept: figures that become files of their own too; by default all of them.
        charts: pictures that can be touched, by name.
    """
    from hdcal.report.canvas import laid_out, render
    from hdcal.report.html import html_page

    title = f"{document.name}: {document.kind}"
    images, files = {}, {}
    for name, figure in figures.items():
        with laid_out(figure, "svg"):
            images[name] = render(figure, "svg", title)
            if kept is None or name in kept:
                files[f"{name}.svg"] = images[name]
                files[f"{name}.png"] = render(figure, "png", title)
    page = html_page(document, images, charts=charts)
    return {PAGE: page.encode("utf-8", "xmlcharrefreplace"), **files}
