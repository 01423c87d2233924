"""Tolerances of the gear's sizes, as what they make of the stiffness.

All of them act through one number, the stiffness over that of the calibrated gear.
"""

from collections.abc import Mapping
from dataclasses import fields, replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from hdcal.data.case import Theory
from hdcal.data.records import Array, Geometry
from hdcal.errors import Finding
from hdcal.physics.theory import THEORIES

# The sizes that may have a tolerance, as people name them.
SIZES = ("wall_thickness_mm", "radius_mm", "length_mm", "load_height_mm")
# Gears whose stiffness is computed, and the strata in which they are kept. These are
# narrower towards both ends, which a high content asks for.
_LOG2_GEARS, _STRATA = 13, 32
# More than this share of a size is a slip of the unit.
_LARGEST = 0.5


class Nodes(eqx.Module):
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
        findings.append(Finding("--tolerance", f"{name} {words}", remedy))

    for name, size in tolerances.items():
        if name not in SIZES:
            find(f"'{name}'", "is no size with a tolerance", f"Use {', '.join(SIZES)}")
            continue
        field = name.removesuffix("_mm")
        nominal = float(getattr(geometry, field))
        if not np.isfinite(size) or size < 0.0:
            find(name, f"= {size:g} is no tolerance", "Give the ± part, in mm")
        elif size > _LARGEST * nominal:
            find(name, f"= {size:g} on a size of {nominal:g} mm", "Give it in mm")
        elif not matters(field, geometry, theory):
            words = f"does not enter the theory '{theory}'"
            find(name, words, "Leave it out, or calibrate with --theory cup")
    return findings


def matters(field: str, geometry: Geometry, theory: Theory) -> bool:
    """Tell whether a size enters a theory's stiffness."""
    stiffness = THEORIES[theory]
    larger = replace(geometry, **{field: 1.01 * float(getattr(geometry, field))})
    return float(stiffness(larger, 1.0)) != float(stiffness(geometry, 1.0))


def relative_stiffness(geometry: Geometry, shifts, theory: Theory):
    """Return the stiffness of changed gears over that of the nominal one.

    Args:
        geometry: nominal.
        shifts: change of each size by field [mm], arrays of one shape.
        theory: of the stiffness.
    """
    changed = replace(
        geometry, **{name: getattr(geometry, name) + by for name, by in shifts.items()}
    )
    return THEORIES[theory](changed, 1.0) / THEORIES[theory](geometry, 1.0)


def tolerance_nodes(
    geometry: Geometry, tolerances: Mapping[str, float], theory: Theory
) -> Nodes:
    """Return the factor's distribution; each size is uniform within its limits.

    Uniform is what is believed of a size of which only limits are known (JCGM
    100:2008, 4.3.7). Differentiable in the geometry.

    Args:
        geometry: nominal.
        tolerances: ± by field [mm].
        theory: of the stiffness.
    """
    if not tolerances:
        return Nodes(jnp.ones(1), jnp.zeros(1), jnp.ones(1))
    points = qmc.Sobol(len(tolerances), scramble=True, rng=0)
    unit = 2.0 * points.random_base2(_LOG2_GEARS) - 1.0
    shifts = {n: t * unit[:, i] for i, (n, t) in enumerate(tolerances.items())}
    factor = jnp.sort(relative_stiffness(geometry, shifts, theory))
    ends = 0.5 - 0.5 * np.cos(np.pi * np.arange(_STRATA + 1) / _STRATA)
    ends = np.round(ends * len(unit)).astype(int)
    stratum = np.repeat(np.arange(_STRATA), np.diff(ends))
    count = np.diff(ends)
    mean = jnp.zeros(_STRATA).at[stratum].add(factor) / count
    square = jnp.zeros(_STRATA).at[stratum].add((factor - mean[stratum]) ** 2) / count
    return Nodes(mean, jnp.sqrt(square), count / len(unit))


def sizes(geometry: Geometry) -> dict[str, float]:
    """Return every size that may have a tolerance, by field [mm]."""
    wanted = {name.removesuffix("_mm") for name in SIZES}
    return {
        f.name: float(getattr(geometry, f.name))
        for f in fields(Geometry)
        if f.name in wanted
    }
