"""Sizes of a gear by name: which there are, what they do to it, what was tested."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Geometry
from hdcal.design.design_draws import Basis
from hdcal.physics.theory import THEORIES

# Name at the edge -> field of the geometry.
SIZES = {
    "wall_thickness_mm": "wall_thickness",
    "radius_mm": "radius",
    "length_mm": "length",
    "load_height_mm": "load_height",
}


def named(name: str) -> str:
    """Return what a size is called on paper: wall_thickness_mm is wall thickness."""
    return name.removesuffix("_mm").removesuffix("_C").replace("_", " ")


def geometry_with(geometry: Geometry, sizes: Mapping[str, Array | float]) -> Geometry:
    """Return the geometry with some of its sizes [mm] replaced, by edge name."""
    return replace(geometry, **{SIZES[name]: value for name, value in sizes.items()})


def stiffness_factor(basis: Basis, geometry: Geometry) -> Float[Array, "..."] | float:
    """Return the stiffness of a gear over that of the tested one, the modulus aside.

    Args:
        basis: tells the theory and the tested gear.
        geometry: sizes [mm], each a number or an array; any Poisson's ratio in it is
            replaced by the one of the material in use.
    """
    own = THEORIES[basis.theory](basis.gear.geometry, 1.0)
    return THEORIES[basis.theory](replace(geometry, poisson=basis.poisson), 1.0) / own


def with_reference(basis: Basis, temperatures: Sequence[float] | None) -> np.ndarray:
    """Return temperatures [°C] in order, the reference one too if it is among them."""
    reference = basis.gear.reference_temperature
    if temperatures is None or not len(temperatures):
        return np.array([reference])
    levels = np.asarray(temperatures, float)
    inside = levels.min() < reference < levels.max()
    return np.unique(np.append(levels, reference) if inside else levels)


def beyond_tested(
    basis: Basis, deformation: np.ndarray, temperature: np.ndarray
) -> list[str]:
    """Say which deformations and temperatures no reading covers, in words."""
    if basis.records is None:
        return []
    ratio = basis.problem.reading.radial_per_read
    told = []
    for name, values, measured, slack, unit in (
        ("deformation", deformation, basis.records.deformation * ratio, 1e-9, "mm"),
        ("temperature", temperature, basis.records.temperature, 1.0, "°C"),
    ):
        low, high = float(np.min(measured)), float(np.max(measured))
        if np.min(values) < low - slack or np.max(values) > high + slack:
            asked = " … ".join(f"{v:g}" for v in sorted({values.min(), values.max()}))
            seen = f"{low:g}" if low == high else f"{low:g} … {high:g}"
            told.append(
                f"Extrapolated: {name} {asked} {unit}, tested were {seen} {unit}. The "
                "band assumes that the model goes on holding."
            )
    return told


def far_from_tested(basis: Basis, sizes: Mapping[str, np.ndarray]) -> list[str]:
    """Say which sizes lie more than a fifth off the tested gear's, in words."""
    told = []
    for name, values in sizes.items():
        own = float(getattr(basis.gear.geometry, SIZES[name]))
        worst = float(values[np.argmax(np.abs(np.log(values / own)))])
        if abs(np.log(worst / own)) > np.log(1.2):
            told.append(
                f"{name} = {worst:g} is far from the gear's {own:g}: no data support "
                "K there."
            )
    return told
