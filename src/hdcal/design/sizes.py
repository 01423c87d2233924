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
