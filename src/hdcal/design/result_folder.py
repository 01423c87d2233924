"""A design's or study's result folder: every file of it, whole or not at all."""

import csv
import io
from pathlib import Path

import numpy as np

from hdcal.design.design_draws import DesignDraws
from hdcal.design.document import generator_words, inverse_words, study_words
from hdcal.design.figure import generator_figure, inverse_figure, profile_figure
from hdcal.design.inverse_design import InverseDesign
from hdcal.design.page import generator_report, inverse_report, study_report
from hdcal.design.study.figure import study_figure
from hdcal.design.study.study import Study
from hdcal.design.summary import (
    summarise_generator,
    summarise_inverse,
    summarise_study,
)
from hdcal.design.wave_generator import WaveGenerator
from hdcal.report.canvas import render
from hdcal.report.folder import whole_folder
from hdcal.report.plain import as_json, as_plain


def write_generator(
    found: WaveGenerator, target: Path | str, *, command: str = "", force: bool = False
) -> dict:
    """Write what `hdcal design --window` leaves behind.

    Args:
        found: from `wave_generator`.
        target: the folder to make.
        command: how the result was made.
        force: replace an older result.

    Returns:
        The design as plain data.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    told = summarise_generator(found)
    told["answer"] = list(generator_words(told))
    at = told["set_point"]["deformation_mm"]
    drawn = {
        "design": generator_figure(found),
        "profile": profile_figure(found.basis.gear.geometry, _modulus(found.basis), at),
    }
    _write(told, drawn, target, generator_report, command, force)
    return told


def write_inverse(
    found: InverseDesign, target: Path | str, *, command: str = "", force: bool = False
) -> dict:
    """Write what `hdcal design --limit-force` leaves behind.

    Args and returns are those of `write_generator`, for `inverse_design`.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    told = summarise_inverse(found)
    told["answer"] = list(inverse_words(told))
    modulus = _modulus(found.chosen.basis)
    shape = profile_figure(found.drawing, modulus, found.deformation)
    drawn = {"profile": shape}
    if found.bounds:
        drawn = {"design": inverse_figure(found), **drawn}
    _write(told, drawn, target, inverse_report, command, force)
    return told


def write_study(
    found: Study, target: Path | str, *, command: str = "", force: bool = False
) -> dict:
    """Write what `hdcal study` leaves behind.

    Args and returns are those of `write_generator`, for `study`.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    told = summarise_study(found)
    told["answer"] = list(study_words(told))
    drawn = {"study": study_figure(found)}
    table = table_csv(told["columns"])
    _write(told, drawn, target, study_report, command, force, table)
    return told


def _write(told, drawn, target, report, command, force, table=None) -> None:
    title = f"{told['gear']['name']}: {'study' if table else 'design'}"
    images = {name: render(f, "svg", title) for name, f in drawn.items()}
    pictures = {name: render(f, "png", title) for name, f in drawn.items()}
    page = report(as_plain(told), images, command)
    with whole_folder(target, force=force) as folder:
        name = "study" if table else "design"
        (folder / f"{name}.json").write_text(as_json(told), "utf-8")
        if table:
            (folder / "study.csv").write_text(table, "utf-8", newline="")
        for image, content in images.items():
            (folder / f"{image}.svg").write_bytes(content)
            (folder / f"{image}.png").write_bytes(pictures[image])
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))


def table_csv(columns: dict) -> str:
    """Return columns as the text of a CSV file."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(columns)
    rows = zip(*columns.values(), strict=True)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return target.getvalue()


def _cell(value) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _modulus(basis: DesignDraws) -> float:
    return float(np.median(np.asarray(basis.values["E0"])))
