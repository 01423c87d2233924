"""What may be asked of a design, and what is said to a question that makes no sense."""

from collections.abc import Iterable, Mapping

import numpy as np

from hdcal.data.toml_file import nearest
from hdcal.design.design_draws import Basis
from hdcal.design.sizes import SIZES
from hdcal.errors import Finding

_LARGEST = 1e5
# Theories that know the height of the load, and the length.
_WITH_HEIGHT = frozenset({"cup"})
_WITH_LENGTH = frozenset({"ring", "cup"})
# Draws that have to fall outside for a probability to be told from its neighbours.
_LEAST_OUTSIDE = 10


def name_findings(
    names: Iterable[str], known: Iterable[str], option: str
) -> list[Finding]:
    """Return a finding for each name that is not known, with the nearest one."""
    listed = list(known)
    return [
        Finding(option, f"unknown key '{name[:60]}'", nearest(name, listed))
        for name in names
        if name not in listed
    ]


def unseen_findings(names: Iterable[str], theory: str, option: str) -> list[Finding]:
    """Return a finding for each size that the theory does not know."""
    silent = {
        "load_height_mm": theory not in _WITH_HEIGHT,
        "length_mm": theory not in _WITH_LENGTH,
    }
    return [
        Finding(
            option,
            f"{name} changes nothing under the theory '{theory}'",
            "leave it out, or use the theory cup",
        )
        for name in names
        if silent.get(name, False)
    ]


def size_findings(
    basis: Basis, sizes: Mapping[str, np.ndarray], option: str
) -> list[Finding]:
    """Return what is impossible about sizes, taken together in every combination.

    Args:
        basis: the tested gear, for the sizes not among them.
        sizes: values [mm] by edge name.
        option: how the user gave them.
    """
    findings = []
    for name, values in sizes.items():
        bad = [v for v in values if not 0.0 < v <= _LARGEST]
        if bad:
            words = f"{name} = {bad[0]:g} is no size"
            findings.append(Finding(option, words, "Give positive sizes in mm"))
    if findings:
        return findings

    def ends(name: str) -> tuple[float, float]:
        own = np.array([getattr(basis.gear.geometry, SIZES[name])])
        values = sizes.get(name, own)
        return float(np.min(values)), float(np.max(values))

    if ends("wall_thickness_mm")[1] >= ends("radius_mm")[0]:
        words = "a wall that is not thinner than the radius"
        findings.append(Finding(option, words, "Check both sizes"))
    seen = basis.theory in _WITH_HEIGHT
    if seen and ends("load_height_mm")[1] > ends("length_mm")[0]:
        words = "a load beyond the length of the gear"
        remedy = "Measure the load height from the closed base"
        findings.append(Finding(option, words, remedy))
    return findings


def place_findings(
    basis: Basis, deformation: np.ndarray, temperature: np.ndarray, least_radius: float
) -> list[Finding]:
    """Return what is impossible about deformations [mm] and temperatures [°C]."""
    findings = []
    if not np.isfinite(deformation).all() or not (deformation > 0.0).all():
        words = "a deformation that is not positive"
        findings.append(Finding("--deformation", words, "Give it in mm, above zero"))
    elif deformation.max() >= least_radius:
        words = f"{deformation.max():g} mm on a radius of {least_radius:g} mm"
        findings.append(Finding("--deformation", words, "Give it in mm"))
    if not np.isfinite(temperature).all():
        words, remedy = "is not finite", "Give numbers in °C"
        findings.append(Finding("--temperature", words, remedy))
    elif temperature.min() < -273.15:
        words, remedy = "is below absolute zero", "Give numbers in °C"
        findings.append(Finding("--temperature", words, remedy))
    else:
        rise = np.max(np.abs(temperature - basis.gear.reference_temperature))
        if np.median(np.asarray(basis.values["alpha"])) * rise >= 0.5:
            words = "the linear law E(T) would lose half of Young's modulus"
            findings.append(Finding("--temperature", words, "Give it in °C"))
    return findings


def probability_findings(basis: Basis, probability: float) -> list[Finding]:
    """Return what is wrong with a required probability."""
    if not 0.0 < probability < 1.0:
        words = f"{probability:g} is not between 0 and 1"
        return [Finding("--probability", words, "Use e.g. 0.99")]
    if (1.0 - probability) * basis.size < _LEAST_OUTSIDE * (1.0 - 1e-9):
        words = f"{probability:g} cannot be told from {basis.size} draws"
        most = 1.0 - _LEAST_OUTSIDE / basis.size
        remedy = f"Ask for {most:.4g} or less, or calibrate with more --draws"
        return [Finding("--probability", words, remedy)]
    return []


def no_deformation() -> Finding:
    """Return the finding for a deformation that nobody named."""
    words = "the gear file names no nominal deformation"
    return Finding("--deformation", words, "Say --deformation 0.4")
