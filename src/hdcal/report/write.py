"""A report's files: the page, the JSON answer, the figures and the tables."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from hdcal.report.csv_table import columns_csv
from hdcal.report.document import Document
from hdcal.report.folder import whole_folder
from hdcal.report.html import html_page
from hdcal.report.plain import as_json

if TYPE_CHECKING:
    from hdcal.report.canvas import Figure

PAGE = "report.html"
A = TypeVar("A", covariant=True)
Tables = Mapping[str, Mapping[str, np.ndarray]]


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
        tables: makes the columns of the CSV files, by the names of the files.
        save: writes what else belongs into the folder.
    """

    document: Document
    answer: A
    file: str
    figures: Callable[[], Mapping[str, "Figure"]] = dict
    kept: Collection[str] | None = None
    tables: Callable[[], Tables] = dict
    save: Callable[[Path], None] | None = None


def write_report(report: Report, target: Path | str, *, force: bool = False) -> None:
    """Write a result folder, whole or not at all.

    Args:
        report: what to write.
        target: the folder to make.
        force: replace an older result.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    # Drawn before the folder is begun: an older result stays as long as possible.
    files = report_files(report.document, report.figures(), report.kept)
    with whole_folder(target, force=force) as folder:
        write_numbers(report, folder)
        write_files(files, folder)


def write_numbers(report: Report, folder: Path) -> None:
    """Write all of a report but page and figures into a folder that is there."""
    (folder / report.file).write_text(as_json(report.answer), "utf-8")
    for name, columns in report.tables().items():
        (folder / name).write_text(columns_csv(columns), "utf-8", newline="")
    if report.save is not None:
        report.save(folder)


def write_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files by their names into a folder that is there."""
    for name, content in files.items():
        (folder / name).write_bytes(content)


def report_files(
    document: Document,
    figures: Mapping[str, "Figure"],
    kept: Collection[str] | None = None,
) -> dict[str, bytes]:
    """Return the page and the pictures of a report by the names of their files.

    Args:
        document: the report.
        figures: of the document's pictures, by name.
        kept: figures that become files of their own too; by default all of them.
    """
    from hdcal.report.canvas import render

    title = f"{document.name}: {document.kind}"
    images = {name: render(figure, "svg", title) for name, figure in figures.items()}
    files = {PAGE: html_page(document, images).encode("utf-8", "xmlcharrefreplace")}
    for name in figures if kept is None else kept:
        files[f"{name}.svg"] = images[name]
        files[f"{name}.png"] = render(figures[name], "png", title)
    return files
