"""A response's result folder: every file of it, whole or not at all."""

from pathlib import Path

from hdcal.motion.figure import response_figure
from hdcal.motion.respond.answer import ResponseAnswer
from hdcal.motion.respond.document import response_document
from hdcal.motion.respond.respond import Response
from hdcal.motion.respond.summary import response_answer
from hdcal.report.csv_table import columns_csv
from hdcal.report.document import Document
from hdcal.report.write import write_report


def write_response(
    response: Response, target: Path | str, *, command: str = "", force: bool = False
) -> tuple[Document, ResponseAnswer]:
    """Write everything that `hdcal respond` leaves behind.

    Args:
        response: from `respond`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The report and the answer, as they were written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    found = response_answer(response)
    document = response_document(response, found, command)
    table = columns_csv(response.columns())

    def save(folder: Path) -> None:
        (folder / "response.csv").write_text(table, "utf-8", newline="")

    write_report(
        target,
        document,
        {"response.json": found},
        {"response": response_figure(response)},
        save=save,
        force=force,
    )
    return document, found
