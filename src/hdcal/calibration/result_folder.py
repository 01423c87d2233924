"""A calibration's result folder: every file of it, whole or not at all."""

from pathlib import Path

from hdcal.calibration.document import calibration_report
from hdcal.calibration.figure.bands import calibration_figure
from hdcal.calibration.figure.residuals import residual_figure
from hdcal.calibration.summary import summarise
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import residuals
from hdcal.prediction.bands.bands import default_bands
from hdcal.report.canvas import render
from hdcal.report.csv_table import columns_csv
from hdcal.report.draws_figure import prior_figure, sampler_figure
from hdcal.report.folder import whole_folder
from hdcal.report.plain import as_json


def write_result(
    posterior: Posterior, target: Path | str, *, command: str = "", force: bool = False
) -> dict:
    """Write everything that `hdcal calibrate` leaves behind.

    Args:
        posterior: from `calibrate`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The summary, as it was written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    left, bands = residuals(posterior), default_bands(posterior)
    summary = summarise(posterior, left)
    title = f"{posterior.case.gear.name}: calibration"
    drawn = {
        "calibration": calibration_figure(posterior, bands, left),
        "residuals": residual_figure(posterior, left),
        "priors": prior_figure(posterior),
        "sampler": sampler_figure(posterior),
    }
    images = {name: render(f, "svg", title) for name, f in drawn.items()}
    picture = render(drawn["calibration"], "png", title)
    page = calibration_report(posterior, summary, images, command)
    with whole_folder(target, force=force) as folder:
        posterior.save(folder / "posterior.nc")
        (folder / "summary.json").write_text(as_json(summary), "utf-8")
        (folder / "bands.csv").write_text(
            columns_csv(bands.columns()), "utf-8", newline=""
        )
        (folder / "calibration.svg").write_bytes(images["calibration"])
        (folder / "calibration.png").write_bytes(picture)
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
    return summary
