"""The report of a calibration: one HTML page that needs nothing else."""

from hdcal.inference.posterior import Posterior
from hdcal.report.page import parameter_row, render_page
from hdcal.report.provenance import THEORY_WORDS, data_rows, prior_rows, provenance_rows
from hdcal.report.words import estimate, label

_TEMPLATE = "calibration.html.j2"


def calibration_report(
    posterior: Posterior, summary: dict, images: dict[str, bytes], command: str = ""
) -> str:
    """Return the report as the text of an HTML file.

    Args:
        posterior: from `calibrate`.
        summary: its summary.
        images: SVG files named calibration, residuals, priors and sampler.
        command: how the result was made.
    """
    context = {
        "kind": "calibration",
        "summary": summary,
        "failed": summary["status"] != "ok",
        "name": posterior.case.gear.name,
        "stiffness": dict(zip(("median", "span"), _stiffness(summary), strict=True)),
        "K": dict(zip(("median", "span"), _K(summary), strict=True)),
        "by_data": _names(summary, "data"),
        "by_prior": _names(summary, "prior"),
        "parameters": [parameter_row(n, e) for n, e in summary["parameters"].items()],
        "theories": _theories(summary),
        "data_rows": data_rows(posterior.case),
        "priors": prior_rows(posterior),
        "provenance": provenance_rows(posterior, summary, command),
    }
    return render_page(_TEMPLATE, context, images)


def _stiffness(summary: dict) -> tuple[str, str]:
    return estimate(summary["stiffness_N_per_mm"])


def _K(summary: dict) -> tuple[str, str]:
    return estimate(summary["parameters"]["K"])


def _names(summary: dict, driver: str) -> list[str]:
    entries = summary["parameters"].items()
    return [label(name) for name, entry in entries if entry["driven_by"] == driver]


def _theories(summary: dict) -> list[dict]:
    rows = []
    for theory, entry in summary["K_by_theory"].items():
        middle, span = ("–", "–") if entry is None else estimate(entry)
        words = THEORY_WORDS.get(theory, "")
        own = theory == summary["gear"]["theory"]
        rows.append(
            {"name": theory, "words": words, "K": middle, "span": span, "own": own}
        )
    return rows
