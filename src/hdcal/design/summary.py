"""Designs and studies as plain data, ready for JSON."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from hdcal.design.candidate import Candidate
from hdcal.design.design_draws import DesignDraws
from hdcal.design.inverse_design import InverseDesign
from hdcal.design.study.article_tables import SCHEMA as ARTICLE_SCHEMA
from hdcal.design.study.article_tables import ArticleRow
from hdcal.design.study.study import SCHEMA as STUDY_SCHEMA
from hdcal.design.study.study import Study
from hdcal.design.wave_generator import WaveGenerator
from hdcal.physics.profile import peak_stress
from hdcal.report.parameters import INTERVAL, interval

SCHEMA = "hdcal.design/1"


def _origin(basis: DesignDraws) -> dict:
    return {
        "gear": {
            "name": basis.gear.name,
            "material": basis.gear.material,
            "theory": basis.theory,
        },
        "basis": basis.kind,
        "draws": basis.size,
        "interval": INTERVAL,
        "interval_kind": basis.interval_kind,
    }


def _error(probability: float, draws: int) -> float:
    """Return the standard error of a probability that was counted among draws."""
    return float(np.sqrt(probability * (1.0 - probability) / draws))


def summarise_generator(found: WaveGenerator) -> dict:
    """Return an elastic wave generator as plain data.

    Args:
        found: from `wave_generator`.
    """
    spring = found.chosen
    return {
        "schema": SCHEMA,
        "status": "ok",
        "kind": "wave_generator",
        **_origin(found.basis),
        "interval_kind": found.gear.interval_kind(found.basis),
        "asked": {
            "window_mm": list(found.window),
            "temperature_C": found.temperatures,
            "probability": found.required,
            "setting_sd_mm": found.setting_sd,
        },
        "population": found.gear.words,
        "spring": {
            "rate_N_per_mm": spring.rate,
            "softest_considered": spring.rate == found.springs[0].rate,
            "rate_over_gear": spring.rate / _gear_rate(found),
            "interference_mm": spring.interference,
            "probability": spring.together,
            "standard_error": _error(spring.together, found.basis.size),
            "zero_backlash": spring.no_backlash,
            "no_jam": spring.no_jam,
        },
        "set_point": _set_point(found),
        "force_N": [_forces(found, i) for i in range(len(found.temperatures))],
        "at_temperature": [_place(found, i) for i in range(len(found.temperatures))],
        "adjusted": _adjusted(found),
        "curve": {
            "rate_N_per_mm": [one.rate for one in found.springs],
            "common": [one.together for one in found.springs],
            "zero_backlash": [one.no_backlash for one in found.springs],
            "no_jam": [one.no_jam for one in found.springs],
            "adjusted": [one.adjusted for one in found.springs],
        },
        "stress": _stress(found),
        "assumptions": found.basis.assumptions,
        "warnings": list(found.warnings),
    }


def _middle(found: WaveGenerator) -> float:
    return 0.5 * sum(found.window)


def _reference(found: WaveGenerator) -> int:
    """Return which of the temperatures is nearest to the reference."""
    off = np.abs(found.temperatures - found.basis.gear.reference_temperature)
    return int(np.argmin(off))


def _gear_rate(found: WaveGenerator) -> float:
    return float(np.median(found.forces[1, _reference(found)]) / _middle(found))


def _set_point(found: WaveGenerator) -> dict:
    """Return the aim: the middle of the window at the reference temperature."""
    level = _reference(found)
    return {
        "deformation_mm": _middle(found),
        "temperature_C": float(found.temperatures[level]),
        "force_N": interval(found.forces[1, level]),
    }


def _forces(found: WaveGenerator, level: int) -> dict:
    names = ("at_lo", "at_middle", "at_hi")
    parts = zip(names, found.forces[:, level], strict=True)
    return {
        "temperature_C": float(found.temperatures[level]),
        **{name: interval(force) for name, force in parts},
    }


def _place(found: WaveGenerator, level: int) -> dict:
    low, high = found.intervals(level)
    x = found.chosen.interference + found.error
    return {
        "temperature_C": float(found.temperatures[level]),
        "zero_backlash": float(np.mean(x >= low)),
        "no_jam": float(np.mean(x <= high)),
        "inside": float(np.mean((x >= low) & (x <= high))),
    }


def _adjusted(found: WaveGenerator) -> dict:
    """Return the range of set points when each gear is given its own."""
    low, high = found.intervals()
    own = 0.5 * (low + high)
    ends = np.array([0.5 - found.required / 2.0, 0.5 + found.required / 2.0])
    reach = np.quantile(own, ends)
    return {
        "probability": found.chosen.adjusted,
        "share_of_gears": found.required,
        "interference_mm": reach,
        "preload_N": found.chosen.rate * (reach - _middle(found)),
    }


def _stress(found: WaveGenerator) -> dict:
    basis = found.basis
    rise = found.temperatures - basis.gear.reference_temperature
    warm = np.max(1.0 - np.asarray(basis.values["alpha"])[:, None] * rise, axis=1)
    modulus = np.asarray(basis.values["E0"]) * warm
    draws = np.asarray(peak_stress(basis.gear.geometry, modulus, found.window[1]))
    return {"deformation_mm": found.window[1], **stress_entry(basis, draws)}


def stress_entry(basis: DesignDraws, draws: np.ndarray) -> dict:
    """Return hoop bending stress and yield utilisation as intervals.

    Args:
        basis: tells the material.
        draws: stress of each draw [MPa].
    """
    strength = basis.yield_strength
    known = strength is not None
    return {
        "stress_MPa": interval(draws),
        "yield_MPa": interval(strength) if known else None,
        "utilisation": interval(draws / strength) if known else None,
    }


def summarise_inverse(found: InverseDesign) -> dict:
    """Return an inverse design as plain data.

    Args:
        found: from `inverse_design`.
    """
    return {
        "schema": SCHEMA,
        "status": "ok",
        "kind": "inverse_geometry",
        **_origin(found.basis),
        "interval_kind": found.gear.interval_kind(found.basis),
        "asked": {
            "deformation_mm": found.deformation,
            "temperature_C": found.temperatures,
            "limit_force_N": found.limit_force,
            "limit_stress_MPa": found.limit_stress,
            "probability": found.required,
            "bounds": {name: list(ends) for name, ends in found.bounds.items()},
        },
        "population": found.gear.words,
        "design": _candidate(found.chosen),
        "tested": _candidate(found.tested),
        "candidates": [_candidate(one) for one in found.candidates],
        "elasticities": dict(found.elasticities),
        "assumptions": found.chosen.basis.assumptions,
        "warnings": list(found.warnings),
    }


def _candidate(one: Candidate) -> dict:
    return {
        "material": one.basis.material,
        "sizes_mm": {name.removesuffix("_mm"): v for name, v in one.sizes.items()},
        "met": one.met,
        "change": one.change,
        "force_N": {**interval(one.forces), "kept": one.force},
        "probability": one.kept,
        "standard_error": _error(one.kept, len(one.forces)),
        **stress_entry(one.basis, one.stresses),
        "utilisation_kept": one.utilisation,
    }


def summarise_study(found: Study) -> dict:
    """Return a study as plain data, its table by column.

    Args:
        found: from `study`.
    """
    return {
        "schema": STUDY_SCHEMA,
        "status": "ok",
        **_origin(found.basis),
        "interval": found.interval,
        "varied": list(found.varied),
        "columns": {name: list(column) for name, column in found.columns.items()},
        "assumptions": list(found.assumptions),
        "warnings": list(found.warnings),
    }


def summarise_article(rows: Sequence[ArticleRow]) -> dict:
    """Return the article's tables as plain data.

    Args:
        rows: from `article_rows`.
    """
    return {
        "schema": ARTICLE_SCHEMA,
        "status": "ok",
        "rows": [asdict(row) for row in rows],
    }
