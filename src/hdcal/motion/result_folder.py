"""A dynamic calibration's result folder: every file of it, whole or not at all."""

from pathlib import Path

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.inference.posterior import FILE_NAME
from hdcal.motion.answer import DynamicCalibrationAnswer
from hdcal.motion.bands import motion_bands
from hdcal.motion.document import motion_document
from hdcal.motion.figure import motion_figure
from hdcal.motion.summary import dynamic_answer
from hdcal.report.document import Document
from hdcal.report.draws_figure import prior_figure, sampler_figure
from hdcal.report.write import write_report


def write_motion(
    posterior: DynamicPosterior,
    target: Path | str,
    *,
    command: str = "",
    force: bool = False,
) -> tuple[Document, DynamicCalibrationAnswer]:
    """Write everything that `hdcal calibrate --dynamic` leaves behind.

    Args:
        posterior: from `calibrate_dynamic`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The report and the summary, as they were written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    found, bands = dynamic_answer(posterior), motion_bands(posterior)
    document = motion_document(posterior, found, command)
    figures = {
        "motion": motion_figure(posterior, bands),
        "priors": prior_figure(posterior),
        "sampler": sampler_figure(posterior),
    }
    write_report(
        target,
        document,
        {"summary.json": found},
        figures,
        kept=["motion"],
        tables={"motion.csv": bands.columns()},
        save=lambda folder: posterior.save(folder / FILE_NAME),
        force=force,
    )
    return document, found
