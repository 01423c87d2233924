"""The report of a margin: one HTML page that needs nothing else."""

from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.document import (
    bound_name,
    chance,
    index,
    input_label,
    newtons,
)
from hdcal.prediction.margin.result import Level, Margin
from hdcal.report.page import render_page
from hdcal.report.provenance import gear_rows
from hdcal.report.words import hypothesis, number

_TEMPLATE = "margin.html.j2"


def margin_report(
    found: Margin,
    posterior: Posterior,
    plain: dict,
    images: dict[str, bytes],
    command: str = "",
) -> str:
    """Return the report as the text of an HTML file.

    Args:
        found: from `margin`.
        posterior: of the likeliest model.
        plain: the margin as plain data.
        images: SVG files named margin and, with sensitivities, tornado.
        command: how the result was made.
    """
    context = {
        "kind": "margin",
        "failed": False,
        "name": posterior.case.gear.name,
        "found": plain,
        "bounds": bound_name(found),
        "levels": [_level(level) for level in found.levels],
        "averaged": [
            newtons(found.worst.lower_bound_N),
            newtons(found.worst.upper_bound_N),
        ],
        "models": [_model(model) for model in plain["models"]],
        "gradients": [_gradient(slope) for slope in plain["gradients"]],
        "provenance": _provenance(found, posterior, plain, command),
    }
    return render_page(_TEMPLATE, context, images)


def _span(span) -> str:
    width = span.hi - span.lo
    return f"{number(span.lo, width)} … {number(span.hi, width)}"


def _level(level: Level) -> dict:
    risk = level.exceedance
    return {
        "temperature": f"{level.temperature_C:g}",
        "tested": level.tested,
        "mean": _span(level.force_N),
        "member": _span(level.member_N),
        "lower": newtons(level.lower_bound_N),
        "upper": newtons(level.upper_bound_N),
        "risk": "–" if risk is None else chance(risk.probability),
        "beta": "–" if risk is None else index(risk.beta),
    }


def _model(model: dict) -> dict:
    return {
        "name": hypothesis(model["model"]),
        "probability": f"{100.0 * model['probability']:.0f} %",
        "lower": newtons(model["lower_bound_N"]),
        "upper": newtons(model["upper_bound_N"]),
    }


def _gradient(slope: dict) -> dict:
    return {
        "name": input_label(slope["name"]),
        "unit": {"E0_GPa": "GPa", "K": ""}.get(slope["name"], "mm"),
        "value": number(slope["value"]),
        "bound": number(slope["bound_N"]),
        "force": number(slope["force_N"]),
        "percent": f"{slope['bound_N_per_percent']:+.2f}",
    }


def _provenance(found: Margin, posterior: Posterior, plain: dict, command: str) -> list:
    tolerances = ", ".join(
        f"{name} ± {size:g}" for name, size in found.tolerances_mm.items()
    )
    rows = [
        *gear_rows(posterior.case, posterior.theory),
        ("tolerances", tolerances or "none given"),
        ("seed", str(plain["seed"])),
        ("versions", ", ".join(f"{k} {v}" for k, v in plain["versions"].items())),
    ]
    return rows + ([("command", command)] if command else [])
