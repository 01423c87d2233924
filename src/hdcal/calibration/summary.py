"""The summary of a calibration: the numbers and words of summary.json."""

from collections.abc import Mapping

from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals, residuals
from hdcal.physics.theory import THEORIES
from hdcal.report.parameters import (
    INTERVAL,
    data_entry,
    flat_directions,
    interval,
    parameter_entries,
    sampling_entry,
    warnings_of,
)

SCHEMA = "hdcal.calibration/1"
ARTICLE_NOTE = (
    "K under `article` is a ratio to that article's slope of 1625.19 N/mm, which no "
    "combination of its own inputs reproduces; its K = 0.13 is no property of the gear."
)


def K_by_theory(posterior: Posterior) -> dict[str, dict[str, float]]:
    """Return K under every theory from the one posterior: K_a k_a = K_b k_b."""
    geometry = posterior.case.gear.geometry
    own = float(THEORIES[posterior.theory](geometry, 1.0))
    return {
        name: interval(posterior.draws["K"] * (own / float(theory(geometry, 1.0))))
        for name, theory in THEORIES.items()
    }


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
