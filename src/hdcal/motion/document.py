"""Reports about a gear that moves: one HTML page each that needs nothing else."""

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.inference.posterior import Posterior
from hdcal.report.page import parameter_row, render_page
from hdcal.report.provenance import gear_rows, prior_rows, provenance_rows
from hdcal.report.words import estimate, with_unit

# Quantity of an answer -> what it is called and its unit.
QUANTITIES = {
    "natural_frequency_Hz": ("natural frequency", "Hz"),
    "damped_frequency_Hz": ("frequency with damping", "Hz"),
    "damping_ratio": ("damping ratio ζ", "1"),
    "damping_N_s_per_mm": ("damping c", "N·s/mm"),
    "mass_kg": ("moved mass m", "kg"),
    "stiffness_N_per_mm": ("stiffness k", "N/mm"),
    "peak_mm": ("largest deformation", "mm"),
}


def quantity_rows(entries: dict[str, dict]) -> list[dict]:
    """Return quantities as the texts of a table's rows."""
    rows = []
    for name, (words, unit) in QUANTITIES.items():
        if name not in entries:
            continue
        middle, span = estimate(entries[name])
        driver = entries[name].get("driven_by", "data")
        rows.append(
            {
                "label": words,
                "median": middle,
                "span": span,
                "unit": with_unit("", unit).strip(),
                "driven_by": driver,
            }
        )
    return rows


def motion_report(
    posterior: DynamicPosterior,
    summary: dict,
    images: dict[str, bytes],
    command: str = "",
) -> str:
    """Return the report of a dynamic calibration as the text of an HTML file.

    Args:
        posterior: from `calibrate_dynamic`.
        summary: its summary.
        images: SVG files named motion, priors and sampler.
        command: how the result was made.
    """
    entries = {name: summary[name] for name in QUANTITIES if name in summary}
    entries["mass_kg"] = summary["parameters"]["mass"]
    context = {
        "kind": "dynamic calibration",
        "summary": summary,
        "failed": summary["status"] != "ok",
        "name": posterior.case.gear.name,
        "quantities": quantity_rows(entries),
        "parameters": [parameter_row(n, e) for n, e in summary["parameters"].items()],
        "priors": prior_rows(posterior),
        "provenance": provenance_rows(posterior, summary, command),
    }
    return render_page("motion.html.j2", context, images)


def response_report(
    posterior: Posterior, summary: dict, images: dict[str, bytes], command: str = ""
) -> str:
    """Return the report of a response as the text of an HTML file.

    Args:
        posterior: what it rests on.
        summary: of the response.
        images: an SVG file named response.
        command: how the result was made.
    """
    context = {
        "kind": "response",
        "summary": summary,
        "failed": False,
        "name": posterior.case.gear.name,
        "quantities": quantity_rows(summary["estimates"]),
        "provenance": [
            *gear_rows(posterior.case, posterior.theory),
            ("calibrated", summary["calibration"]),
            ("gears integrated", str(summary["draws"])),
            *([("command", command)] if command else []),
        ],
    }
    return render_page("response.html.j2", context, images)
