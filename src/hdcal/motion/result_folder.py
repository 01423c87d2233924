"""Result folders about a gear that moves: its calibration, its response."""

from pathlib import Path

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.inference.posterior import FILE_NAME, Posterior
from hdcal.motion.document import motion_report, response_report
from hdcal.motion.figure import motion_figure, response_figure
from hdcal.motion.respond.respond import Response
from hdcal.motion.summary import (
    motion_bands,
    summarise_dynamic,
    summarise_response,
)
from hdcal.report.canvas import render
from hdcal.report.csv_table import columns_csv
from hdcal.report.draws_figure import prior_figure, sampler_figure
from hdcal.report.folder import whole_folder
from hdcal.report.plain import as_json


def write_motion(
    posterior: DynamicPosterior,
    target: Path | str,
    *,
    command: str = "",
    force: bool = False,
) -> dict:
    """Write everything that `hdcal calibrate --dynamic` leaves behind.

    Args:
        posterior: from `calibrate_dynamic`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The summary, as it was written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    summary, bands = summarise_dynamic(posterior), motion_bands(posterior)
    title = f"{posterior.case.gear.name}: dynamic calibration"
    drawn = {
        "motion": motion_figure(posterior, bands),
        "priors": prior_figure(posterior),
        "sampler": sampler_figure(posterior),
    }
    images = {name: render(f, "svg", title) for name, f in drawn.items()}
    picture = render(drawn["motion"], "png", title)
    page = motion_report(posterior, summary, images, command)
    with whole_folder(target, force=force) as folder:
        posterior.save(folder / FILE_NAME)
        _write(folder, "summary.json", as_json(summary))
        _write(folder, "motion.csv", columns_csv(bands.columns()))
        (folder / "motion.svg").write_bytes(images["motion"])
        (folder / "motion.png").write_bytes(picture)
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
    return summary


def write_response(
    response: Response,
    posterior: Posterior,
    target: Path | str,
    *,
    command: str = "",
    force: bool = False,
) -> dict:
    """Write everything that `hdcal respond` leaves behind.

    Args:
        response: from `respond`.
        posterior: what it rests on.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Returns:
        The summary, as it was written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    summary = summarise_response(response, posterior)
    title = f"{posterior.case.gear.name}: response"
    drawn = response_figure(posterior, response)
    image = render(drawn, "svg", title)
    picture = render(drawn, "png", title)
    page = response_report(posterior, summary, {"response": image}, command)
    with whole_folder(target, force=force) as folder:
        _write(folder, "response.json", as_json(summary))
        _write(folder, "response.csv", columns_csv(response.columns()))
        (folder / "response.svg").write_bytes(image)
        (folder / "response.png").write_bytes(picture)
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
    return summary


def _write(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text, "utf-8", newline="")
