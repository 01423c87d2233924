"""The result folders of designs and studies, each whole or not at all."""

from pathlib import Path

from hdcal.design.answer import GeneratorAnswer, InverseAnswer
from hdcal.design.document import generator_document, inverse_document
from hdcal.design.figure import generator_figures, inverse_figures
from hdcal.design.inverse_design import InverseDesign
from hdcal.design.study.answer import StudyAnswer
from hdcal.design.study.document import study_document
from hdcal.design.study.figure import study_figure
from hdcal.design.study.study import Study
from hdcal.design.study.summary import study_answer
from hdcal.design.summary import generator_answer, inverse_answer
from hdcal.design.wave_generator import WaveGenerator
from hdcal.report.document import Document
from hdcal.report.write import write_report


def write_generator(
    found: WaveGenerator, target: Path | str, *, command: str = "", force: bool = False
) -> tuple[Document, GeneratorAnswer]:
    """Write what `hdcal design --window` leaves behind.

    Args:
        found: from `wave_generator`.
        target: the folder to make.
        command: how the result was made.
        force: replace an older result.

    Returns:
        The report and the answer in the folder.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    answer = generator_answer(found)
    document = generator_document(answer, command)
    figures = generator_figures(found)
    write_report(target, document, {"design.json": answer}, figures, force=force)
    return document, answer


def write_inverse(
    found: InverseDesign, target: Path | str, *, command: str = "", force: bool = False
) -> tuple[Document, InverseAnswer]:
    """Write what `hdcal design --limit-force` leaves behind.

    Args and returns are those of `write_generator`, for `inverse_design`.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    answer = inverse_answer(found)
    document = inverse_document(answer, command)
    figures = inverse_figures(found)
    write_report(target, document, {"design.json": answer}, figures, force=force)
    return document, answer


def write_study(
    found: Study, target: Path | str, *, command: str = "", force: bool = False
) -> tuple[Document, StudyAnswer]:
    """Write what `hdcal study` leaves behind.

    Args and returns are those of `write_generator`, for `study`.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    answer = study_answer(found)
    document = study_document(answer, command)
    write_report(
        target,
        document,
        {"study.json": answer},
        {"study": study_figure(found)},
        tables={"study.csv": found.columns},
        force=force,
    )
    return document, answer
