"""Exact derivatives of the bound: another gear's sizes, modulus and coefficient.

These change the stiffness; what was calibrated stays.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import numpy as np

from hdcal.data.case import Theory
from hdcal.data.records import Geometry
from hdcal.exported import jit
from hdcal.inference.problem import Problem
from hdcal.prediction.engine.conditions import Conditions
from hdcal.prediction.engine.mixture import (
    Mixture,
    quantile_weights,
    weighted_quantile,
)
from hdcal.prediction.engine.population import Whose
from hdcal.prediction.engine.population_force import PopulationForce, mixtures
from hdcal.prediction.engine.sizes import (
    SIZES,
    matters,
    shifted,
    stiffness_ratio,
    tolerance_strata,
)
from hdcal.prediction.margin.request import Criteria

# What scales the stiffness of every draw: its site, and code units in the unit shown.
_MODULI = {"E0_GPa": ("E0", 1e3), "K": ("K", 1.0)}


@dataclass(frozen=True)
class Gradient:
    """How the bound of the larger size and the mean force change with one input.

    All forces have their sign.

    Attributes:
        name: of the input, with its unit.
        value: where the derivative is taken.
        bound_N: derivative of that bound, before it is rounded [N per unit].
        force_N: derivative of the mean force, averaged over the draws [N per unit].
        bound_N_per_percent: change of the bound when the input grows by 1 % [N].
    """

    name: str
    value: float
    bound_N: float
    force_N: float
    bound_N_per_percent: float


class Redesign(eqx.Module):
    """The forces of a population as a function of the gear's sizes, modulus and K.

    Attributes:
        problem: structure.
        values: draws by site: [draw, …].
        whose: force it is.
        conditions: of the calibrated gear.
        geometry: of it.
        tolerances: ± by field [mm].
        origin: its sizes [mm], modulus [GPa] and K, by name.
        theory: of the stiffness.
    """

    problem: Problem
    values: dict
    whose: Whose
    conditions: Conditions
    geometry: Geometry
    tolerances: dict[str, float]
    origin: dict[str, float]
    theory: Theory = eqx.field(static=True)

    @classmethod
    def of(cls, force: PopulationForce, moduli: Mapping[str, float]) -> "Redesign":
        """Return the forces of a population as they are.

        Args:
            force: of the population.
            moduli: where the derivative by the modulus [GPa] and by K is taken; what
                counts is how many times as large they become.
        """
        posterior = force.cause.posterior
        geometry, theory = posterior.case.gear.geometry, posterior.theory
        origin = {
            name: float(getattr(geometry, field))
            for name, field in SIZES.items()
            if matters(field, geometry, theory)
        } | dict(moduli)
        return cls(
            problem=posterior.problem,
            values=dict(force.cause.values),
            whose=force.whose,
            conditions=force.conditions,
            geometry=geometry,
            tolerances=dict(force.tolerances),
            origin=origin,
            theory=theory,
        )

    def mixture(self, point: Mapping[str, Any]) -> Mixture:
        """Return the forces of a gear with other inputs, named as in `origin`."""
        shifts = {
            field: point[name] - self.origin[name]
            for name, field in SIZES.items()
            if name in point
        }
        changed = shifted(self.geometry, shifts)
        scale = stiffness_ratio(changed, self.geometry, self.theory)
        for name in _MODULI:
            scale = scale * (point[name] / self.origin[name])
        strata = tolerance_strata(changed, self.tolerances, self.theory)
        there = replace(self.conditions, scale=scale, strata=strata)
        return mixtures(self.problem, self.values, self.whose, there)


@jit
def _mean_slopes(gear: Redesign):
    """Return the derivative of the mean force, averaged over the draws, by input."""
    return jax.jacfwd(lambda point: gear.mixture(point).centre().mean())(gear.origin)


@jit
def _bound_slopes(gear: Redesign, weights, content):
    """Return the derivative of a weighted sum of the draws' quantiles, by input.

    The quantiles are those along the sense of loading, their sum has its sign.
    """

    def bound(point):
        along = gear.mixture(point).along(gear.conditions.loading)
        return gear.conditions.loading * (weights @ along.quantile(content))

    return jax.jacfwd(bound)(gear.origin)


def _of_all(forces: Sequence[PopulationForce], site: str) -> np.ndarray:
    return np.concatenate([force.cause.values[site] for force in forces])


def gradients(
    forces: Sequence[PopulationForce], quantiles: np.ndarray, criteria: Criteria
) -> tuple[Gradient, ...]:
    """Return the exact derivatives of the larger bound at one temperature.

    Args:
        forces: of each cause, at that temperature.
        quantiles: of the population along the sense of loading, in each draw of all
            causes, shape (d,).
        criteria: content and confidence of the bound.
    """
    weights = np.concatenate([force.cause.weights for force in forces])
    moduli = {
        name: weighted_quantile(_of_all(forces, site), weights, 0.5) / unit
        for name, (site, unit) in _MODULI.items()
    }
    gears = [Redesign.of(force, moduli) for force in forces]
    # The bound lies between two draws: only their derivatives are in it.
    used = quantile_weights(quantiles, weights, criteria.confidence)
    origin = gears[0].origin
    bound, mean = dict.fromkeys(origin, 0.0), dict.fromkeys(origin, 0.0)
    start = 0
    for force, gear in zip(forces, gears, strict=True):
        part = used[start : start + force.cause.size]
        start += force.cause.size
        for name, slope in _mean_slopes(gear).items():
            mean[name] += force.cause.probability * float(slope)
        if not part.any():
            continue
        few = {name: column[part > 0.0] for name, column in gear.values.items()}
        few, part = replace(gear, values=few), part[part > 0.0]
        for name, slope in _bound_slopes(few, part, criteria.content).items():
            bound[name] += float(slope)
    return tuple(
        Gradient(n, v, bound[n], mean[n], 0.01 * v * bound[n])
        for n, v in origin.items()
    )
