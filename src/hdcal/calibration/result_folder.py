"""A calibration's result folder: every file of it, whole or not at all."""

from pathlib import Path

from hdcal.calibration.answer import CalibrationAnswer
from hdcal.calibration.document import calibration_document
from hdcal.calibration.figure.bands import calibration_figure
from hdcal.calibration.figure.residuals import residual_figure
from hdcal.calibration.summary import calibration_answer
from hdcal.inference.posterior import FILE_NAME, Posterior
from hdcal.inference.residuals import residuals
from hdcal.prediction.bands.bands import default_bands
from hdcal.report.document import Document
from hdcal.report.draws_figure import prior_figure, sampler_figure
from hdcal.report.write import write_report


def write_calibration(
    posterior: Posterior, target: Path | str, *, command: str = "", force: bool = False
) -> tuple[Document, CalibrationAnswer]:
    """Write everything that `hdcal calibrate` leaves behind.

    Args:
        posterior: from `calibrate`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The report and the summary, as they were written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    left, bands = residuals(posterior), default_bands(posterior)
    found = calibration_answer(posterior, left)
    document = calibration_document(posterior, found, command)
    figures = {
        "calibration": calibration_figure(posterior, bands, left),
        "residuals": residual_figure(posterior, left),
        "priors": prior_figure(posterior),
        "sampler": sampler_figure(posterior),
    }
    write_report(
        target,
        document,
        {"summary.json": found},
        figures,
        kept=["calibration"],
        tables={"bands.csv": bands.columns()},
        save=lambda folder: posterior.save(folder / FILE_NAME),
        force=force,
    )
    return document, found
