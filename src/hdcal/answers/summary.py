"""The summary of a calibration: the numbers and words of summary.json."""

from collections.abc import Mapping

import numpy as np

from hdcal.answers.residuals import Residuals, residuals
from hdcal.inference.diagnoses import Diagnosis
from hdcal.inference.posterior import Posterior
from hdcal.physics.effect import parameters
from hdcal.physics.theory import THEORIES

SCHEMA = "hdcal.calibration/1"
INTERVAL = 0.95
# Name -> (unit for people, factor from code units).
UNITS: dict[str, tuple[str, float]] = {
    "K": ("1", 1.0),
    "E0": ("GPa", 1e-3),
    "alpha": ("1/K", 1.0),
    "force_offset": ("N", 1.0),
    "deformation_offset": ("mm", 1.0),
    "sigma": ("N", 1.0),
    "run_offset_sd": ("N", 1.0),
    "specimen_sd": ("1", 1.0),
    "gap_sd": ("N", 1.0),
    "gap_length": ("1", 1.0),
    "mass": ("kg", 1e3),
    "damping_ratio": ("1", 1.0),
    "initial_deformation": ("mm", 1.0),
    "initial_velocity": ("mm/s", 1.0),
    "deformation_sigma": ("mm", 1.0),
}
ARTICLE_NOTE = (
    "K under `article` is a ratio to that article's slope of 1625.19 N/mm, which no "
    "combination of its own inputs reproduces; its K = 0.13 is no property of the gear."
)


def interval(values: np.ndarray) -> dict[str, float]:
    """Return median and equal-tailed 95 % credible interval."""
    tail = (1.0 - INTERVAL) / 2.0
    lo, median, hi = np.quantile(values, [tail, 0.5, 1.0 - tail])
    return {"median": float(median), "lo": float(lo), "hi": float(hi)}


def unit_of(posterior: Posterior, name: str) -> tuple[str, float]:
    """Return the unit in which a parameter is shown, and its factor."""
    if name in UNITS:
        return UNITS[name]
    effect_name, field = name.split(".")
    effect = next(e for e in posterior.effects if e.name == effect_name)
    return parameters(effect)[field].unit, 1.0


def parameter_entry(posterior: Posterior, name: str, found: Diagnosis | None) -> dict:
    """Return a parameter as an entry of a summary; fixed ones have no diagnosis."""
    unit, factor = unit_of(posterior, name)
    entry = {"unit": unit, **interval(posterior.draws[name] * factor)}
    if found is None:  # fixed by the gear file
        return {
            **entry,
            "rhat": None,
            "ess_bulk": None,
            "ess_tail": None,
            "driven_by": "prior",
            "contraction": 0.0,
        }
    numbers = {name: _finite(value) for name, value in vars(found).items()}
    return {**entry, **numbers}


def _finite(value):
    # JSON has no NaN: a statistic that could not be computed is null.
    return None if isinstance(value, float) and not np.isfinite(value) else value


def K_by_theory(posterior: Posterior) -> dict[str, dict[str, float]]:
    """Return K under every theory from the one posterior: K_a k_a = K_b k_b."""
    geometry = posterior.case.gear.geometry
    own = float(THEORIES[posterior.theory](geometry, 1.0))
    return {
        name: interval(posterior.draws["K"] * (own / float(theory(geometry, 1.0))))
        for name, theory in THEORIES.items()
    }


def flat_directions(posterior: Posterior) -> list[str]:
    """Return the sentences about what the data cannot tell apart."""
    return [check.words for check in posterior.checks if check.outcome == "note"]


def summarise(posterior: Posterior, left: Residuals | None = None) -> dict:
    """Return the summary as plain data, ready for JSON.

    Args:
        posterior: from `calibrate`.
        left: its residuals, if they are at hand.
    """
    left = left or residuals(posterior)
    settings, case = posterior.settings, posterior.case
    warnings = warnings_of(posterior)
    return {
        "schema": SCHEMA,
        "status": "ok" if posterior.usable else "failed",
        "reasons": list(posterior.reasons),
        "warnings": warnings + [shape.words for shape in left.structure],
        "parameters": parameter_entries(posterior),
        "stiffness_N_per_mm": interval(posterior.draws["stiffness"]),
        "K_by_theory": K_by_theory(posterior),
        "K_note": ARTICLE_NOTE,
        "flat_directions": flat_directions(posterior),
        "interval": INTERVAL,
        "interval_kind": "equal-tailed credible interval",
        "residuals": [vars(shape) for shape in left.structure],
        "checks": [vars(check) for check in posterior.checks],
        "next_steps": next_steps(posterior, left),
        "sampling": sampling_entry(posterior),
        "seed": settings["seed"],
        "versions": settings["versions"],
        "gear": {
            "name": case.gear.name,
            "material": case.gear.material,
            "theory": posterior.theory,
        },
        "effects": [effect.name for effect in posterior.effects],
        "with_gap": settings["with_gap"],
        "data": data_entry(posterior),
    }


def parameter_entries(posterior: Posterior) -> dict[str, dict]:
    """Return every parameter's entry by name, those that were fixed last."""
    names = [*posterior.diagnoses]
    names += [n for n in posterior.priors if n in posterior.draws and n not in names]
    return {
        name: parameter_entry(posterior, name, posterior.diagnoses.get(name))
        for name in names
    }


def warnings_of(posterior: Posterior) -> list[str]:
    """Return the warnings of the checks as sentences."""
    return [
        check.words[:1].upper() + check.words[1:]
        for check in posterior.checks
        if check.outcome == "warning"
    ]


def sampling_entry(posterior: Posterior) -> dict:
    """Return how the draws were come by."""
    stats = posterior.tree["sample_stats"].to_dataset()
    names = ("chains", "warmup", "draws", "target_acceptance", "seconds")
    settings = {name: posterior.settings[name] for name in names}
    return settings | {"divergences": int(stats["diverging"].sum())}


def data_entry(posterior: Posterior) -> dict:
    """Return which data it was."""
    case = posterior.case
    return {
        "name": case.name,
        "rows": len(case.records.force),
        "sha256": case.data_sha256,
        "notes": list(case.notes),
    }


_REMEDY: Mapping[str, str] = {
    "curvature": "Unload as well as load, take finer steps at small deformation, or "
    "re-seat the gear and repeat: each separates some causes of curvature.",
    "end": "Take more readings near the largest deformation, loading and unloading.",
    "direction": "Try --effect coulomb_friction.",
    "temperature": "Try --effect thermal_zero_drift.",
    "temperature x deformation": "Check the prior of alpha for this material.",
    "time": "Try --effect charge_leakage, and repeat the first point at the end.",
    "order": "Repeat the first point at the end: it tells drift from stiffness.",
}


def next_steps(posterior: Posterior, left: Residuals) -> list[str]:
    """Say what would make the answer better, most urgent first."""
    if not posterior.usable:
        return [
            "Do not use this result. Calibrate with more --warmup and --draws; if it "
            "still fails, look at the data and leave effects out."
        ]
    steps = [_REMEDY[shape.name] for shape in left.structure]
    known = posterior.case.records.known
    if "temperature" not in known:
        steps.append(
            "Measure at a second temperature: only then do data speak of alpha."
        )
    if "unloading" not in known:
        steps.append("Unload too: without it friction and hysteresis cannot be seen.")
    if "specimen" not in known:
        steps.append("Measure a second gear: one gear says nothing about the next one.")
    return list(dict.fromkeys(steps))
