"""One HTML page that needs nothing else, from a template and harmless texts."""

import base64

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from hdcal.data.case import Case
from hdcal.report.plain import harmless
from hdcal.report.words import estimate, label, number, unit, with_unit

THEORY_WORDS = {
    "ring": "inextensible ring",
    "cup": "cup with a held base",
    "article": "slope plotted in the article",
}


def render_page(template: str, context: dict, images: dict[str, bytes]) -> str:
    """Return a page as text.

    Args:
        template: name of the file in templates.
        context: texts and numbers, from anywhere.
        images: SVG files, drawn by hdcal.
    """
    # Escaping is on for every text; only the images' bytes are ours entirely.
    environment = Environment(
        loader=PackageLoader("hdcal.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pictures = {name: _address(image) for name, image in images.items()}
    page = environment.get_template(template)
    return page.render(**harmless(context), images=pictures)


def _address(image: bytes) -> str:
    # As an image the drawing can run no script and share no names with the page.
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")


def parameter_row(name: str, entry: dict) -> dict:
    """Return a parameter of a summary as the texts of a table's row."""
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


def data_rows(case: Case) -> list[tuple[str, str]]:
    """Return what was measured, as pairs of name and words."""
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


def gear_rows(case: Case, theory: str) -> list[tuple[str, str]]:
    """Return which gear it was and how it was modelled, as pairs of name and words."""
    gear = case.gear
    size = gear.geometry
    return [
        ("case", case.name),
        ("gear", gear.name),
        ("material", gear.material),
        (
            "wall thickness × radius × length",
            f"{size.wall_thickness:g} × {size.radius:g} × {size.length:g} mm",
        ),
        ("load height", f"{size.load_height:g} mm"),
        ("theory", f"{theory} ({THEORY_WORDS.get(theory, '')})"),
        ("reference temperature", f"{gear.reference_temperature:g} °C"),
        ("SHA-256 of the data", case.data_sha256),
    ]
