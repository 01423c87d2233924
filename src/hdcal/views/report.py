"""The report of a calibration: one HTML page that needs nothing else."""

import base64
from importlib.resources import files

import numpy as np
from jinja2 import Environment, StrictUndefined

from hdcal.inference.posterior import Posterior
from hdcal.rig.case import Case
from hdcal.views.plain import harmless
from hdcal.views.wording import (
    estimate,
    label,
    number,
    prior_words,
    unit,
    with_unit,
)

_TEMPLATE = "templates/report.html.j2"
_THEORY_WORDS = {
    "ring": "inextensible ring",
    "cup": "cup with a held base",
    "article": "slope plotted in the article",
}


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
    # Escaping is on for every text; only the images' bytes are ours entirely.
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.from_string(
        files("hdcal.views").joinpath(_TEMPLATE).read_text("utf-8")
    )
    context = {
        "summary": summary,
        "failed": summary["status"] != "ok",
        "name": posterior.case.gear.name,
        "stiffness": dict(zip(("median", "span"), _stiffness(summary), strict=True)),
        "K": dict(zip(("median", "span"), _K(summary), strict=True)),
        "by_data": _names(summary, "data"),
        "by_prior": _names(summary, "prior"),
        "parameters": [_row(n, e) for n, e in summary["parameters"].items()],
        "theories": _theories(summary),
        "data_rows": _data_rows(posterior.case),
        "priors": _priors(posterior),
        "provenance": _provenance(posterior, summary, command),
    }
    pictures = {name: _address(image) for name, image in images.items()}
    return template.render(**harmless(context), images=pictures)


def _stiffness(summary: dict) -> tuple[str, str]:
    return estimate(summary["stiffness_N_per_mm"])


def _K(summary: dict) -> tuple[str, str]:
    return estimate(summary["parameters"]["K"])


def _names(summary: dict, driver: str) -> list[str]:
    entries = summary["parameters"].items()
    return [label(name) for name, entry in entries if entry["driven_by"] == driver]


def _row(name: str, entry: dict) -> dict:
    middle, span = estimate(entry)
    return {
        "name": name,
        "label": label(name),
        "median": middle,
        "span": span,
        "unit": unit(entry["unit"]),
        "driven_by": entry["driven_by"],
        "contraction": _share(entry["contraction"]),
        "rhat": "–" if entry["rhat"] is None else f"{entry['rhat']:.3f}",
        "ess": [_count(entry["ess_bulk"]), _count(entry["ess_tail"])],
    }


def _share(value: float | None) -> str:
    return "–" if value is None else f"{max(value, 0.0):.0%}"


def _count(value: float | None) -> str:
    return "–" if value is None else f"{value:.0f}"


def _theories(summary: dict) -> list[dict]:
    rows = []
    for theory, entry in summary["K_by_theory"].items():
        middle, span = ("–", "–") if entry is None else estimate(entry)
        words = _THEORY_WORDS.get(theory, "")
        own = theory == summary["gear"]["theory"]
        rows.append(
            {"name": theory, "words": words, "K": middle, "span": span, "own": own}
        )
    return rows


def _data_rows(case: Case) -> list[tuple[str, str]]:
    records, gear = case.records, case.gear

    def ends(values, shown: str) -> str:
        low, high = number(float(np.min(values))), number(float(np.max(values)))
        return with_unit(low if low == high else f"{low} … {high}", shown)

    moves = {"loading": 1, "holding": 0, "unloading": -1}
    count = {
        word: np.count_nonzero(records.direction == s) for word, s in moves.items()
    }
    warmth = ends(records.temperature, "°C")
    if "temperature" not in records.known:
        warmth += ", not measured: the reference temperature"
    rows = [
        ("rows", str(len(records.force))),
        ("deformation", f"{ends(records.deformation, 'mm')}, {gear.reading}, as read"),
        ("force", f"{ends(records.force, 'N')}, as read"),
        ("temperature", warmth),
        ("direction", ", ".join(f"{n} {word}" for word, n in count.items() if n)),
        ("runs", str(len(case.run_labels) or 1)),
        ("gears", str(len(case.specimen_labels) or 1)),
    ]
    if gear.force_resolution:
        rows.append(("force read in steps of", f"{gear.force_resolution:g} N"))
    return rows + [("note", note) for note in case.notes]


def _priors(posterior: Posterior) -> list[dict]:
    shown = [name for name in posterior.priors if name in posterior.draws]
    return [
        {
            "label": label(name),
            "words": prior_words(name, posterior.priors[name]),
            "source": posterior.priors[name].source or "the gear file",
        }
        for name in shown
    ]


def _provenance(posterior: Posterior, summary: dict, command: str) -> list:
    sampling, gear = summary["sampling"], posterior.case.gear
    size = gear.geometry
    rows = [
        ("case", posterior.case.name),
        ("gear", gear.name),
        ("material", gear.material),
        (
            "wall thickness × radius × length",
            f"{size.wall_thickness:g} × {size.radius:g} × {size.length:g} mm",
        ),
        ("load height", f"{size.load_height:g} mm"),
        ("theory", f"{posterior.theory} ({_THEORY_WORDS.get(posterior.theory, '')})"),
        ("effects", ", ".join(effect.name for effect in posterior.effects) or "none"),
        ("reference temperature", f"{gear.reference_temperature:g} °C"),
        ("SHA-256 of the data", posterior.case.data_sha256),
        (
            "sampling",
            f"NUTS, {sampling['chains']} chains of {sampling['draws']} draws after "
            f"{sampling['warmup']} of warm-up, seed {summary['seed']}",
        ),
        ("seconds", f"{sampling['seconds']:.1f}"),
        ("versions", ", ".join(f"{k} {v}" for k, v in summary["versions"].items())),
    ]
    return rows + ([("command", command)] if command else [])


def _address(image: bytes) -> str:
    # As an image the drawing can run no script and share no names with the page.
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")
