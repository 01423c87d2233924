"""A calibration's result folder: every file of it, whole or not at all."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hdcal.answers.bands import Bands, default_bands
from hdcal.answers.residuals import residuals
from hdcal.answers.summary import summarise
from hdcal.inference.posterior import Posterior
from hdcal.views import figures
from hdcal.views.folder import whole_folder
from hdcal.views.plain import as_json
from hdcal.views.report import calibration_report


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
        "calibration": figures.calibration_figure(posterior, bands, left),
        "residuals": figures.residual_figure(posterior, left),
        "priors": figures.prior_figure(posterior),
        "sampler": figures.sampler_figure(posterior),
    }
    images = {name: figures.render(f, "svg", title) for name, f in drawn.items()}
    picture = figures.render(drawn["calibration"], "png", title)
    page = calibration_report(posterior, summary, images, command)
    with whole_folder(target, force=force) as folder:
        posterior.save(folder / "posterior.nc")
        (folder / "summary.json").write_text(as_json(summary), "utf-8")
        (folder / "bands.csv").write_text(bands_csv(bands), "utf-8", newline="")
        (folder / "calibration.svg").write_bytes(images["calibration"])
        (folder / "calibration.png").write_bytes(picture)
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
    return summary


def bands_csv(bands: Bands) -> str:
    """Return bands as the text of a CSV file; what was not fitted stays empty."""
    return columns_csv(bands.columns())


def columns_csv(columns: Mapping[str, np.ndarray]) -> str:
    """Return columns as the text of a CSV file."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(columns)
    texts = [[_cell(value) for value in column.tolist()] for column in columns.values()]
    writer.writerows(zip(*texts, strict=True))
    return target.getvalue()


def _cell(value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # A millionth of a newton is far below any reading.
        return "" if value != value else f"{value:.9g}"
    return str(value)
