"""What one diagnosis leaves behind, in a folder that is there already."""

from dataclasses import replace
from pathlib import Path

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.summary import verdict_answer
from hdcal.diagnosis.verdict import Verdict, member_files
from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.bands import Bands, default_bands
from hdcal.prediction.engine.causes import ORIGIN
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
) -> VerdictAnswer:
    """Write everything that `hdcal diagnose` leaves behind for one case.

    Args:
        verdict: from `diagnose`.
        folder: an empty one, from `whole_folder`.
        command: how the result was made, for its provenance.
        report: whether figures and report are wanted; they take most of the time.
        seed: the diagnosis was made with.
        quick: whether nothing was sampled.

    Returns:
        The answer, as it was written.
    """
    found = verdict_answer(verdict, seed=seed, quick=quick)
    (folder / "verdict.json").write_text(as_json(found), "utf-8")
    refit, bands = corrected(verdict), None
    if refit is not None:
        bands = default_bands(list(verdict.posteriors.values()))
        _save_models(verdict, folder)
        table = columns_csv(bands.columns())
        (folder / "bands.csv").write_text(table, "utf-8", newline="")
    if report:
        _write_report(verdict, found, refit, bands, command, folder)
    return found


def corrected(verdict: Verdict) -> tuple[str, Posterior] | None:
    """Return the most probable corrected model with its name."""
    weighed = verdict.posteriors
    if not weighed:
        return None
    name = max(weighed, key=lambda name: weighed[name][0])
    return name, weighed[name][1]


def _save_models(verdict: Verdict, folder: Path) -> None:
    """Save every calibrated model, each with the probabilities of all."""
    chances = {name: share for name, (share, _) in verdict.posteriors.items()}
    for name, file in member_files(verdict).items():
        posterior = verdict.posteriors[name][1]
        origin = {"hypothesis": name, "probabilities": chances}
        settings = {**posterior.settings, ORIGIN: origin}
        replace(posterior, settings=settings).save(folder / file)


def _write_report(
    verdict: Verdict,
    found: VerdictAnswer,
    refit: tuple[str, Posterior] | None,
    bands: Bands | None,
    command: str,
    folder: Path,
) -> None:
    from hdcal.calibration.figure.bands import calibration_figure
    from hdcal.diagnosis.document import verdict_document
    from hdcal.diagnosis.figure.closure import shrink_figure
    from hdcal.diagnosis.figure.where import where_figure
    from hdcal.diagnosis.figure.which import which_figure
    from hdcal.inference.residuals import residuals
    from hdcal.report.write import report_files

    figures = {
        "where": where_figure(verdict),
        "which": which_figure(verdict),
        "shrink": shrink_figure(verdict),
    }
    if refit is not None and bands is not None:
        left = residuals(refit[1])
        figures["bands"] = calibration_figure(refit[1], bands, left)
    document = verdict_document(found, verdict.case, command, refit)
    for name, content in report_files(document, figures).items():
        (folder / name).write_bytes(content)
