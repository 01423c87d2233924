"""Checks of a request: names, sizes, conditions and probabilities."""

from collections.abc import Iterable, Mapping

import numpy as np

from hdcal.data.gear_file.toml_file import did_you_mean
from hdcal.data.plausible import implausible
from hdcal.design.design_draws import DesignDraws
from hdcal.errors import Finding
from hdcal.prediction.engine.conditions import level_findings, temperature_findings
from hdcal.prediction.engine.sizes import SIZES, matters

# Draws that have to fall outside for a probability to be estimated.
_LEAST_OUTSIDE = 10


def name_findings(
    names: Iterable[str], known: Iterable[str], where: str
) -> list[Finding]:
    """Return a finding for each name that is not known, with the nearest one."""
    listed = list(known)
    return [
        Finding(where, f"unknown key '{name}'", did_you_mean(name, listed))
        for name in names
        if name not in listed
    ]


def unused_findings(draws: DesignDraws, sizes: Iterable[str]) -> list[Finding]:
    """Return a finding for each varied size that is not in the theory."""
    words = f"changes nothing under the theory '{draws.theory}'"
    return [
        Finding("vary", f"{name} {words}", "leave it out, or use the theory cup")
        for name in sizes
        if not matters(SIZES[name], draws.gear.geometry, draws.theory)
    ]


def size_findings(draws: DesignDraws, sizes: Mapping[str, np.ndarray]) -> list[Finding]:
    """Return what is impossible about varied sizes, in every combination of them.

    Args:
        draws: of the tested gear, for the sizes not among them.
        sizes: values [mm] by edge name.
    """
    findings = []
    for name, values in sizes.items():
        for wrong in implausible("vary", values, "size"):
            words = f"{name} = {wrong.problem}"
            findings.append(Finding("vary", words, "Give positive sizes in mm"))
    if findings:
        return findings

    def ends(name: str) -> tuple[float, float]:
        values = sizes.get(name, np.array([draws.size_of(name)]))
        return float(np.min(values)), float(np.max(values))

    if ends("wall_thickness_mm")[1] >= ends("radius_mm")[0]:
        words = "a wall that is not thinner than the radius"
        findings.append(Finding("vary", words, "Check both sizes"))
    matter = matters("load_height", draws.gear.geometry, draws.theory)
    if matter and ends("load_height_mm")[1] > ends("length_mm")[0]:
        words = "a load beyond the length of the gear"
        remedy = "Measure the load height from the closed base"
        findings.append(Finding("vary", words, remedy))
    return findings


def place_findings(
    draws: DesignDraws,
    deformation: np.ndarray,
    temperature: np.ndarray,
    least_radius: float,
    names: tuple[str, str] = ("deformation", "temperatures"),
) -> list[Finding]:
    """Return what is impossible about deformations [mm] and temperatures [°C].

    Args:
        draws: of the tested gear.
        deformation: radial, of either sense of loading [mm].
        temperature: [°C].
        least_radius: that deformations have to stay below [mm].
        names: of the two parameters.
    """
    findings, (where, warmth) = [], names
    farthest = deformation[np.argmax(np.abs(deformation))]
    if wrong := implausible(where, deformation, "deformation"):
        findings += wrong
    elif (deformation == 0.0).any():
        words = "a deformation that is zero"
        findings.append(Finding(where, words, "Give it in mm, above or below zero"))
    elif abs(farthest) >= least_radius:
        words = f"{farthest:g} mm on a radius of {least_radius:g} mm"
        findings.append(Finding(where, words, "Give it in mm"))
    return findings + (
        level_findings(temperature, warmth)
        or temperature_findings(draws.gear, draws.values, temperature, warmth)
    )


def probability_findings(draws: DesignDraws, probability: float) -> list[Finding]:
    """Return what is wrong with a required probability."""
    if wrong := implausible("probability", probability):
        return wrong
    size = draws.independent
    if (1.0 - probability) * size < _LEAST_OUTSIDE * (1.0 - 1e-9):
        words = f"{probability:g} cannot be estimated from {draws.size} draws"
        if size < draws.size:
            words += f", equivalent to {size:.0f} independent ones"
        most = 1.0 - _LEAST_OUTSIDE / size
        remedy = f"Ask for {most:.4g} or less, or calibrate with more draws"
        return [Finding("probability", words, remedy)]
    return []


def no_deformation() -> Finding:
    """Return the finding for a deformation that was not given."""
    words = "the gear file names no nominal deformation"
    return Finding("deformation", words, "Give one in mm, such as 0.4")
