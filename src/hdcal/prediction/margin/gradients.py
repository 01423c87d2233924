"""Exact derivatives of the bound: another gear's sizes, modulus and coefficient.

These change the stiffness; what was calibrated stays.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import jax
import numpy as np

from hdcal.prediction.mixture import Mixture, weighted_quantile
from hdcal.prediction.population_force import Outlook
from hdcal.prediction.size_tolerances import (
    SIZES,
    matters,
    relative_stiffness,
    sizes,
    tolerance_nodes,
)

_MPA_PER_GPA = 1e3


@dataclass(frozen=True)
class Gradient:
    """How the upper bound and the mean force change with one input.

    Attributes:
        name: of the input, with its unit.
        value: where the derivative is taken.
        bound_N: derivative of the upper bound [N per unit].
        force_N: derivative of the mean force, averaged over the draws [N per unit].
        bound_N_per_percent: change of the bound when the input grows by 1 % [N].
    """

    name: str
    value: float
    bound_N: float
    force_N: float
    bound_N_per_percent: float


def design_point(outlook: Outlook) -> dict[str, float]:
    """Return the inputs of `bound_of`: sizes [mm], modulus [GPa] and K, by name."""
    case, draws = outlook.posterior.case, outlook.values
    geometry, theory = case.gear.geometry, outlook.posterior.theory
    point = {
        f"{name}_mm": value
        for name, value in sizes(geometry).items()
        if matters(name, geometry, theory)
    }
    modulus = float(np.median(draws["E0"])) / _MPA_PER_GPA
    return {**point, "E0_GPa": modulus, "K": float(np.median(draws["K"]))}


def mixture_at(outlook: Outlook, temperature, tolerances, point, origin) -> Mixture:
    """Return the forces of a gear of other sizes, modulus or influence coefficient.

    Args:
        outlook: of the calibrated gear.
        temperature: of the specimen [°C].
        tolerances: ± by field [mm].
        point: inputs by name; may be traced.
        origin: the calibrated gear's, from `design_point`.
    """
    geometry, theory = outlook.posterior.case.gear.geometry, outlook.posterior.theory
    shifts = {
        name.removesuffix("_mm"): point[name] - origin[name]
        for name in SIZES
        if name in point
    }
    scale = relative_stiffness(geometry, shifts, theory)
    scale = scale * (point["E0_GPa"] / origin["E0_GPa"]) * (point["K"] / origin["K"])
    changed = replace(
        geometry, **{name: getattr(geometry, name) + by for name, by in shifts.items()}
    )
    nodes = tolerance_nodes(changed, tolerances, theory)
    return outlook.mixture(temperature, scale, nodes)


def gradients(
    outlooks: Sequence[tuple[float, Outlook]],
    temperature: float,
    tolerances: dict[str, float],
    quantiles: np.ndarray,
    weights: np.ndarray,
    content: float,
    confidence: float,
) -> tuple[Gradient, ...]:
    """Return the exact derivatives of the upper bound at one temperature.

    Args:
        outlooks: of each model, with its probability.
        temperature: of the specimen [°C].
        tolerances: ± by field [mm].
        quantiles: of the population in each draw of all models, shape (d,).
        weights: of the draws.
        content: of the bound.
        confidence: of the bound.
    """
    # The bound lies between two draws: only their derivatives are in it.
    _, used = weighted_quantile(quantiles, weights, confidence)
    origin = design_point(outlooks[0][1])
    bound = dict.fromkeys(origin, 0.0)
    force = dict.fromkeys(origin, 0.0)
    start = 0
    for share, outlook in outlooks:
        size = len(outlook.values["K"])
        part = used[start : start + size]
        start += size
        own = design_point(outlook)
        at = partial(mixture_at, temperature=temperature, tolerances=tolerances)

        def centre(point, outlook=outlook, own=own, at=at):
            return at(outlook, point=point, origin=own).centre().mean()

        def upper(point, outlook=outlook, own=own, at=at, part=part):
            few = {n: column[part > 0.0] for n, column in outlook.values.items()}
            mixture = at(replace(outlook, values=few), point=point, origin=own)
            return part[part > 0.0] @ mixture.quantile(content)

        for name, slope in jax.jit(jax.jacfwd(centre))(own).items():
            force[name] += share * float(slope)
        if part.any():
            for name, slope in jax.jit(jax.jacfwd(upper))(own).items():
                bound[name] += float(slope)
    return tuple(
        Gradient(n, v, bound[n], force[n], 0.01 * v * bound[n])
        for n, v in origin.items()
    )
