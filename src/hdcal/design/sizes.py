"""Names of sizes, geometries with other sizes, and temperatures of a design."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdcal.data.records import Array, Geometry
from hdcal.design.design_draws import DesignDraws
from hdcal.prediction.engine.sizes import SIZES


def named(name: str) -> str:
    """Return the name of a size without its unit: wall_thickness_mm, wall thickness."""
    return name.removesuffix("_mm").removesuffix("_C").replace("_", " ")


def geometry_with(geometry: Geometry, sizes: Mapping[str, Array | float]) -> Geometry:
    """Return the geometry with some of its sizes [mm] replaced, by edge name."""
    return replace(geometry, **{SIZES[name]: value for name, value in sizes.items()})


def with_reference(
    draws: DesignDraws, temperatures: Sequence[float] | None
) -> np.ndarray:
    """Return temperatures [°C] in order, the reference one too if it is among them."""
    reference = draws.gear.reference_temperature
    if temperatures is None or not len(temperatures):
        return np.array([reference])
    levels = np.asarray(temperatures, float)
    inside = levels.min() < reference < levels.max()
    return np.unique(np.append(levels, reference) if inside else levels)
