"""Sizes of a gear: what they and their tolerances make of the stiffness.

All of them act through one number, the stiffness over that of the calibrated gear.
"""

from collections.abc import Mapping
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.plausible import implausible
from hdcal.data.records import Array, Geometry
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding
from hdcal.physics.theory import THEORIES
from hdcal.prediction.engine.even_points import spread_evenly

# The sizes that may change or have a tolerance, as people name them, and their field.
SIZES = {
    "wall_thickness_mm": "wall_thickness",
    "radius_mm": "radius",
    "length_mm": "length",
    "load_height_mm": "load_height",
}
# Gears whose stiffness is computed, and the strata in which they are kept. These are
# narrower towards both ends, which a high content asks for.
_LOG2_GEARS, _STRATA = 13, 32
# More than this share of a size is a slip of the unit.
_LARGEST = 0.5


class StiffnessStrata(eqx.Module):
    """The distribution of the factor of the stiffness, in strata.

    Attributes:
        factor: mean of each stratum [-].
        width: sd within it [-].
        weight: its share.
    """

    factor: Float[Array, " j"]
    width: Float[Array, " j"]
    weight: Float[Array, " j"]


def check_tolerances(
    tolerances: Mapping[str, float], geometry: Geometry, theory: Theory
) -> list[Finding]:
    """Return what is wrong with tolerances given as ± mm by name."""
    findings = []

    def find(name, words, remedy):
        findings.append(Finding("tolerances", f"{name} {words}", remedy))

    for name, size in tolerances.items():
        if name not in SIZES:
            find(f"'{name}'", "is no size with a tolerance", f"Use {', '.join(SIZES)}")
            continue
        nominal = float(getattr(geometry, SIZES[name]))
        if wrong := implausible("tolerances", size):
            find(name, f"= {wrong[0].problem}", "Give the ± part, in mm")
        elif size > _LARGEST * nominal:
            find(name, f"= {size:g} on a size of {nominal:g} mm", "Give it in mm")
        elif not matters(SIZES[name], geometry, theory):
            words = f"does not enter the theory '{theory}'"
            other = "the sizes of the gear" if theory == SPRING else "the theory cup"
            find(name, words, f"Leave it out, or calibrate with {other}")
    return findings


def matters(field: str, geometry: Geometry, theory: Theory) -> bool:
    """Tell whether a size enters a theory's stiffness."""
    larger = shifted(geometry, {field: 0.01 * float(getattr(geometry, field))})
    return float(stiffness_ratio(larger, geometry, theory)) != 1.0


def shifted(geometry: Geometry, shifts: Mapping) -> Geometry:
    """Return the geometry with sizes changed by so much [mm], by field."""
    moved = {name: getattr(geometry, name) + by for name, by in shifts.items()}
    return replace(geometry, **moved)


def stiffness_ratio(geometry: Geometry, tested: Geometry, theory: Theory):
    """Return the stiffness of a gear over that of the tested one, modulus aside [-]."""
    return THEORIES[theory](geometry, 1.0) / THEORIES[theory](tested, 1.0)


def tolerance_strata(
    geometry: Geometry, tolerances: Mapping[str, float], theory: Theory
) -> StiffnessStrata:
    """Return the factor's distribution; each size is uniform within its limits.

    Uniform is what is believed of a size of which only limits are known (JCGM
    100:2008, 4.3.7). Differentiable in the geometry.

    Args:
        geometry: nominal.
        tolerances: ± by field [mm].
        theory: of the stiffness.
    """
    if not tolerances:
        return StiffnessStrata(np.ones(1), np.zeros(1), np.ones(1))
    unit = 2.0 * spread_evenly(1 << _LOG2_GEARS, len(tolerances), seed=0) - 1.0
    # In one order, whatever that of the dict: JAX sorts the keys of a traced one.
    fields = [field for field in SIZES.values() if field in tolerances]
    shifts = {n: tolerances[n] * unit[:, i] for i, n in enumerate(fields)}
    factor = jnp.sort(stiffness_ratio(shifted(geometry, shifts), geometry, theory))
    ends = 0.5 - 0.5 * np.cos(np.pi * np.arange(_STRATA + 1) / _STRATA)
    count = np.diff(np.round(ends * len(unit)).astype(int))
    stratum = np.repeat(np.arange(_STRATA), count)
    mean = jnp.zeros(_STRATA).at[stratum].add(factor) / count
    square = jnp.zeros(_STRATA).at[stratum].add((factor - mean[stratum]) ** 2) / count
    return StiffnessStrata(mean, jnp.sqrt(square), count / len(unit))
