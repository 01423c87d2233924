"""Sizes, deformations and temperatures of a design: named, and beside the tested."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdcal.data.records import Array, Geometry
from hdcal.design.design_draws import DesignDraws
from hdcal.prediction.engine.conditions import NEAR_K, NEAR_MM
from hdcal.prediction.engine.sizes import SIZES


def named(name: str) -> str:
    """Return what a size is called on paper: wall_thickness_mm is wall thickness."""
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


def beyond_tested(
    draws: DesignDraws, deformation: np.ndarray, temperature: np.ndarray
) -> list[str]:
    """Say which deformations and temperatures no reading covers, in words."""
    if draws.records is None:
        return []
    ratio = draws.problem.reading.radial_per_read
    radial, told = draws.records.deformation * ratio, []
    for name, values, measured, slack, unit in (
        ("deformation", deformation, radial, NEAR_MM, "mm"),
        ("temperature", temperature, draws.records.temperature, NEAR_K, "°C"),
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


def far_from_tested(draws: DesignDraws, sizes: Mapping[str, np.ndarray]) -> list[str]:
    """Say which sizes lie more than a fifth off the tested gear's, in words."""
    told = []
    for name, values in sizes.items():
        own = float(getattr(draws.gear.geometry, SIZES[name]))
        worst = float(values[np.argmax(np.abs(np.log(values / own)))])
        if abs(np.log(worst / own)) > np.log(1.2):
            told.append(
                f"{name} = {worst:g} is far from the gear's {own:g}: no data support "
                "K there."
            )
    return told
