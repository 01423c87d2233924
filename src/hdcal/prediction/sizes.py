"""Sizes of a gear: what they and their tolerances make of its stiffness."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.data.records import Geometry
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding
from hdcal.physics.theory import THEORIES

# Sizes that may change or have a tolerance, as users name them, and their field.
SIZES = {
    "wall_thickness_mm": "wall_thickness",
    "radius_mm": "radius",
    "length_mm": "length",
    "load_height_mm": "load_height",
}
# Gears of which the stiffness is computed, and the nodes that represent them.
_GEARS, _NODES = 4096, 32
# A tolerance of more than this share of a size is a wrong unit.
_LARGEST = 0.5


def check_tolerances(
    tolerances: Mapping[str, float], geometry: Geometry, theory: Theory
) -> list[Finding]:
    """Return what is wrong with tolerances given as ± mm by name."""
    findings = []

    def find(name, words, remedy):
        findings.append(Finding("tolerances", f"{name} {words}", remedy))

    for name, size in tolerances.items():
        if name not in SIZES:
            find(f"'{name}'", "is not a size", f"Use {', '.join(SIZES)}")
            continue
        nominal = float(getattr(geometry, SIZES[name]))
        if wrong := implausible("tolerances", size):
            find(name, f"= {wrong[0].problem}", "Give the value after ±, in mm")
        elif size > _LARGEST * nominal:
            find(
                name, f"= {size:g} mm is too large for {nominal:g} mm", "Check the unit"
            )
        elif not matters(SIZES[name], geometry, theory):
            words = f"has no influence under the theory '{theory}'"
            other = "the sizes of the gear" if theory == SPRING else "the theory cup"
            find(name, words, f"Leave it out, or calibrate with {other}")
    return findings


def matters(field: str, geometry: Geometry, theory: Theory) -> bool:
    """Return whether a size enters a theory's stiffness."""
    larger = shifted(geometry, {field: 0.01 * float(getattr(geometry, field))})
    return float(stiffness_ratio(larger, geometry, theory)) != 1.0


def shifted(geometry: Geometry, shifts: Mapping) -> Geometry:
    """Return the geometry with sizes changed by so much [mm], by field."""
    moved = {name: getattr(geometry, name) + by for name, by in shifts.items()}
    return replace(geometry, **moved)


def stiffness_ratio(geometry: Geometry, tested: Geometry, theory: Theory):
    """Return the stiffness of a gear over that of the tested one, modulus aside [-]."""
    return THEORIES[theory](geometry, 1.0) / THEORIES[theory](tested, 1.0)


def size_nodes(
    geometry: Geometry, tolerances: Mapping[str, float], theory: Theory
) -> tuple[np.ndarray, np.ndarray]:
    """Return factors on the stiffness by the sizes of a gear, and their shares.

    Each size is uniform within its tolerance, ± by field [mm]: only limits are known
    (JCGM 100:2008, 4.3.7). The nodes are those of Gauss and Legendre on the quantiles
    of the factor.
    """
    if not tolerances:
        return np.ones(1), np.ones(1)
    rng, even = np.random.default_rng(0), np.linspace(-1.0, 1.0, _GEARS)
    shifts = {name: by * rng.permutation(even) for name, by in tolerances.items()}
    factor = stiffness_ratio(shifted(geometry, shifts), geometry, theory)
    level, share = np.polynomial.legendre.leggauss(_NODES)
    return np.quantile(np.asarray(factor), 0.5 + 0.5 * level), 0.5 * share
