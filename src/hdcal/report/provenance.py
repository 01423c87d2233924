"""Provenance of a result: data, gear, model, sampling, versions."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdcal.data.case import Case
from hdcal.data.loading import loading
from hdcal.data.theory_names import SPRING, THEORY_WORDS
from hdcal.inference.posterior import Posterior
from hdcal.report.words import number


def provenance_rows(posterior: Posterior) -> list[tuple[str, str]]:
    """Return pairs of name and text about the model of a posterior."""
    settings: Mapping[str, Any] = posterior.settings
    return [
        *gear_rows(posterior.case, posterior.theory),
        ("effects", ", ".join(effect.name for effect in posterior.effects) or "none"),
        (
            "sampling",
            f"NUTS, {settings['chains']} chains of {settings['draws']} draws after "
            f"{settings['warmup']} of warm-up, seed {settings['seed']}",
        ),
        ("seconds", f"{settings['seconds']:.1f}"),
        ("versions", ", ".join(f"{k} {v}" for k, v in settings["versions"].items())),
    ]


def data_rows(case: Case) -> list[tuple[str, str]]:
    """Return pairs of name and text about the measurements."""
    records, gear, units = case.records, case.gear, case.units

    def ends(values, shown: str) -> str:
        low, high = number(float(np.min(values))), number(float(np.max(values)))
        return f"{low if low == high else f'{low} … {high}'} {shown}"

    moves = {"loading": 1, "holding": 0, "unloading": -1}
    way = loading(case.from_unloaded, np.asarray(records.direction))
    count = {word: np.count_nonzero(way == sign) for word, sign in moves.items()}
    warmth = ends(records.temperature, "°C")
    if "temperature" not in records.known:
        warmth += ", not measured: the reference temperature"
    along = ends(records.deformation, units.displacement_unit)
    reading = f", {gear.read_as}" if gear.read_as and units.is_force else ""
    rows = [
        ("rows", str(len(records.force))),
        (units.displacement, f"{along}{reading}, as read"),
        (units.load, f"{ends(records.force, units.load_unit)}, as read"),
        ("temperature", warmth),
        ("direction", ", ".join(f"{n} {word}" for word, n in count.items() if n)),
        ("runs", str(len(case.run_labels) or 1)),
        ("gears", str(len(case.specimen_labels) or 1)),
    ]
    if gear.force_resolution:
        rows.append(("force read in steps of", f"{gear.force_resolution:g} N"))
    return rows + [("note", note) for note in case.notes]


def gear_rows(case: Case, theory: str) -> list[tuple[str, str]]:
    """Return pairs of name and text about the gear and its theory."""
    gear = case.gear
    size = gear.geometry
    sizes = [
        (
            "wall thickness × radius × length",
            f"{size.wall_thickness:g} × {size.radius:g} × {size.length:g} mm",
        ),
        ("load height", f"{size.load_height:g} mm"),
    ]
    return [
        ("case", case.name),
        ("gear", gear.name),
        ("material", gear.material),
        *(pair for pair in sizes if theory != SPRING),
        ("theory", f"{theory} ({THEORY_WORDS.get(theory, '')})"),
        ("reference temperature", f"{gear.reference_temperature:g} °C"),
        ("SHA-256 of the data", case.data_sha256),
    ]
