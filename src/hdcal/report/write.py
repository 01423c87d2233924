"""A report's files: the page, the JSON answer and the figures."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.report.canvas import Figure, render
from hdcal.report.csv_table import columns_csv
from hdcal.report.document import Document
from hdcal.report.folder import whole_folder
from hdcal.report.html import html_page
from hdcal.report.plain import as_json

PAGE = "report.html"


def write_report(
    target: Path | str,
    document: Document,
    answers: Mapping[str, Any],
    figures: Mapping[str, Figure] | None = None,
    *,
    kept: Collection[str] | None = None,
    tables: Mapping[str, Mapping[str, np.ndarray]] | None = None,
    save: Callable[[Path], None] | None = None,
    force: bool = False,
) -> None:
    """Write a result folder, whole or not at all.

    Args:
        target: the folder to make.
        document: the report.
        answers: dataclasses or plain data of the JSON files, by name.
        figures: of the document's pictures, by name.
        kept: figures that become files of their own too, as SVG and PNG; by default
            all of them.
        tables: columns of the CSV files, by the names of the files.
        save: writes what else belongs into the folder.
        force: replace an older result.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    # Drawn before the folder is begun: an older result stays as long as possible.
    files = report_files(document, figures or {}, kept)
    with whole_folder(target, force=force) as folder:
        for name, answer in answers.items():
            (folder / name).write_text(as_json(answer), "utf-8")
        for name, content in files.items():
            (folder / name).write_bytes(content)
        for name, columns in (tables or {}).items():
            (folder / name).write_text(columns_csv(columns), "utf-8", newline="")
        if save is not None:
            save(folder)


def report_files(
    document: Document,
    figures: Mapping[str, Figure],
    kept: Collection[str] | None = None,
) -> dict[str, bytes]:
    """Return the page and the pictures of a report by the names of their files.

    Args:
        document: the report.
        figures: of the document's pictures, by name.
        kept: figures that become files of their own too; by default all of them.
    """
    title = f"{document.name}: {document.kind}"
    images = {name: render(figure, "svg", title) for name, figure in figures.items()}
    files = {PAGE: html_page(document, images).encode("utf-8", "xmlcharrefreplace")}
    for name in figures if kept is None else kept:
        files[f"{name}.svg"] = images[name]
        files[f"{name}.png"] = render(figures[name], "png", title)
    return files
