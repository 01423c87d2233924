"""What one diagnosis leaves behind, in a folder that is there already."""

from dataclasses import replace
from pathlib import Path

from hdcal.calibration.figure.bands import calibration_figure
from hdcal.diagnosis.document import verdict_report
from hdcal.diagnosis.figure.closure import shrink_figure
from hdcal.diagnosis.figure.where import where_figure
from hdcal.diagnosis.figure.which import which_figure
from hdcal.diagnosis.verdict import Verdict, member_files
from hdcal.diagnosis.verdict_json import verdict_json
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import residuals
from hdcal.prediction.bands.bands import default_bands
from hdcal.prediction.engine.causes import ORIGIN
from hdcal.report.canvas import render
from hdcal.report.csv_table import columns_csv
from hdcal.report.plain import as_json


def write_verdict(
    verdict: Verdict,
    folder: Path,
    *,
    command: str = "",
    report: bool = True,
    seed: int = 0,
    quick: bool = False,
) -> dict:
    """Write everything that `hdcal diagnose` leaves behind for one case.

    Args:
        verdict: from `diagnose`.
        folder: an empty one, from `whole_folder`.
        command: how the result was made, for its provenance.
        report: whether figures and report are wanted; they take most of the time.
        seed: the diagnosis was made with.
        quick: whether nothing was sampled.

    Returns:
        The verdict as plain data, as it was written.
    """
    found = verdict_json(verdict, seed=seed, quick=quick)
    (folder / "verdict.json").write_text(as_json(found), "utf-8")
    refit, bands = corrected(verdict), None
    if refit is not None:
        bands = default_bands(list(verdict.posteriors.values()))
        _save_models(verdict, folder)
        (folder / "bands.csv").write_text(
            columns_csv(bands.columns()), "utf-8", newline=""
        )
    if report:
        images = _draw(verdict, refit, bands, folder)
        page = verdict_report(verdict, found, images, command, refit).encode(
            "utf-8", "xmlcharrefreplace"
        )
        (folder / "report.html").write_bytes(page)
    return found


def _save_models(verdict: Verdict, folder: Path) -> None:
    """Save every calibrated model, each with the probabilities of all."""
    chances = {name: share for name, (share, _) in verdict.posteriors.items()}
    for name, file in member_files(verdict).items():
        posterior = verdict.posteriors[name][1]
        origin = {"hypothesis": name, "probabilities": chances}
        settings = {**posterior.settings, ORIGIN: origin}
        replace(posterior, settings=settings).save(folder / file)


def corrected(verdict: Verdict) -> tuple[str, Posterior] | None:
    """Return the most probable corrected model with its name."""
    weighed = verdict.posteriors
    if not weighed:
        return None
    name = max(weighed, key=lambda name: weighed[name][0])
    return name, weighed[name][1]


def _draw(verdict: Verdict, refit, bands, folder: Path) -> dict[str, bytes]:
    """Write every figure, and return the SVG files by name."""
    title = f"{verdict.case.gear.name}: diagnosis"
    drawn = {
        "where": where_figure(verdict),
        "which": which_figure(verdict),
        "shrink": shrink_figure(verdict),
    }
    if refit is not None:
        left = residuals(refit[1])
        drawn["bands"] = calibration_figure(refit[1], bands, left)
    images = {name: render(f, "svg", title) for name, f in drawn.items()}
    for name, figure in drawn.items():
        (folder / f"{name}.svg").write_bytes(images[name])
        (folder / f"{name}.png").write_bytes(render(figure, "png", title))
    return images
