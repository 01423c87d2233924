"""Shares of the variance of one future member's force, by what brings them.

Sobol's shares assume independent inputs. Stiffness and zeros are tied together by the
data, and of K and E₀ only the product is known: all of these are one input, the draw.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtri

from hdcal.exported import jit
from hdcal.prediction.engine.causes import Cause, Driver
from hdcal.prediction.engine.even_points import spread_evenly
from hdcal.prediction.engine.mixture import Mixture
from hdcal.prediction.engine.population import new_member_sd
from hdcal.prediction.engine.population_force import (
    PopulationForce,
    leftover,
    member_force,
)
from hdcal.prediction.engine.sizes import shifted, stiffness_ratio
from hdcal.prediction.engine.untested import PLACES

# Points of each input's sample; a power of two.
_POINTS = 4096
# What untested conditions may add, in the order of a draw's places.
_UNTESTED = ("leftover", "zero_drift", "frame")
# Largest correlation at which α counts as an input of its own.
_INDEPENDENT = 0.2


@dataclass(frozen=True)
class VarianceShare:
    """How much of the variance of one future member's force is one input's.

    Attributes:
        name: of the input.
        first: share that goes when the input becomes known (first order).
        total: share that stays when all others become known (total order).
        driven_by: data, prior, or given by whoever asked (tolerances).
    """

    name: str
    first: float
    total: float
    driven_by: Driver


@jit
def _mean_forces(problem, values, conditions):
    """Return the mean reading of every draw along the sense of loading [N].

    Scatter and noise are left out.
    """

    def one(value):
        force = member_force(problem, value, "reading", conditions, 1.0)[0]
        return conditions.loading * force

    return jax.vmap(one)(values)


@jit
def _member_forces(problem, values, whose, conditions, factor, level):
    """Return forces with their noise, each of draw, factor and level of its own.

    They are along the sense of loading.
    """

    def one(value, factor, level):
        force, (log_weight, sd) = member_force(
            problem, value, whose.quantity, conditions, factor
        )
        law = Mixture(jnp.exp(log_weight), jnp.zeros_like(sd), sd)
        noise = law.quantile(level) if whose.quantity == "reading" else 0.0
        force = force + leftover(problem, value, whose.quantity, conditions)
        return conditions.loading * force + noise

    return jax.vmap(one)(values, factor, level)


def variance_shares(
    forces: Sequence[PopulationForce], seed: int = 0
) -> tuple[VarianceShare, ...]:
    """Return Sobol's first-order and total shares of one future member's force.

    Args:
        forces: of each cause, at the temperature in question.
        seed: of the sample.
    """
    inputs = _inputs(forces)
    names = list(inputs)
    if len(names) < 2:
        return tuple(VarianceShare(name, 1.0, 1.0, inputs[name]) for name in names)
    ranked = [_ranked(force) for force in forces]
    chances = np.cumsum([force.cause.probability for force in forces])

    def force_of(points: np.ndarray) -> np.ndarray:
        level = dict(zip(names, points.T, strict=True))
        cause = level.get("cause", np.zeros(len(points)))
        model = np.searchsorted(chances[:-1], cause, side="right")
        each = [
            _forces_at(force, order, level)
            for force, order in zip(forces, ranked, strict=True)
        ]
        return np.stack(each)[model, np.arange(len(model))]

    first, total = sobol_indices(force_of, len(names), _POINTS, seed)
    return tuple(
        VarianceShare(name, float(first[i]), float(total[i]), inputs[name])
        for i, name in enumerate(names)
    )


def sobol_indices(
    function: Callable[[np.ndarray], np.ndarray], inputs: int, count: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first-order and total indices of independent inputs, shape (k,) each.

    Args:
        function: of points between 0 and 1, shape (n, k), returns shape (n,).
        inputs: their number, k.
        count: points of each sample.
        seed: of them.

    Source:
        Saltelli et al., Computer Physics Communications 181 (2010), 259.
    """
    # Of one set of points: those of two are even only each by itself.
    ours, others = np.split(spread_evenly(count, 2 * inputs, seed), 2, axis=1)
    own, other = function(ours), function(others)
    both = np.stack([own, other])
    middled, found = other - both.mean(), []
    for place in range(inputs):
        exchanged = ours.copy()
        exchanged[:, place] = others[:, place]
        change = function(exchanged) - own
        found.append((np.mean(middled * change), 0.5 * np.mean(change**2)))
    first, total = np.transpose(found) / both.var()
    return first, total


def _ranked(force: PopulationForce) -> np.ndarray:
    """Return the draws in the order of their mean force: a smooth single input."""
    cause = force.cause
    means = _mean_forces(cause.problem, cause.values, force.conditions)
    return np.argsort(np.asarray(means), kind="stable")


def _alpha_stands_alone(cause: Cause) -> bool:
    """Tell whether α is the prior's, and tied to nothing else by the data."""
    alpha = cause.values["alpha"]
    if cause.driver("alpha") == "data" or np.ptp(alpha) == 0.0:
        return False
    tied = np.corrcoef(alpha, cause.values["stiffness"])[0, 1]
    return bool(abs(tied) < _INDEPENDENT)


def _inputs(forces: Sequence[PopulationForce]) -> dict[str, Driver]:
    """Return the inputs that matter, and what drives each."""
    cause, whose, where = forces[0].cause, forces[0].whose, forces[0].conditions
    found: dict[str, Driver] = {"calibration": "data"}
    if len(forces) > 1:
        found["cause"] = "data"
    rise = float(where.temperature) - cause.posterior.case.gear.reference_temperature
    if rise and all(_alpha_stands_alone(force.cause) for force in forces):
        found["alpha"] = "prior"
    if whose.quantity == "reading":
        found["noise"] = cause.driver("sigma")
    if whose.tested_mountings(cause.problem):
        found["mounting"] = cause.driver("run_offset_sd")
    if whose.tested_gears(cause.problem):
        found["gear"] = cause.driver("specimen_sd")
    found |= dict.fromkeys(forces[0].tolerances, "given")
    if not where.low <= where.deformation <= where.high:
        found["leftover"] = "prior"
    # A cause that holds a drift as its effect has none that is open.
    for untested in (force.conditions.untested for force in forces):
        if whose.quantity == "reading" and float(untested.kelvins(where.temperature)):
            drifts = {"zero_drift": untested.zero[1], "frame": untested.frame[1]}
            found |= {name: "prior" for name, sd in drifts.items() if sd > 0.0}
    return found


def _forces_at(
    force: PopulationForce, ranked: np.ndarray, level: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Return the force of one cause at levels, between 0 and 1, of every input.

    It is along the sense of loading, as what scatters about zero is.
    """
    cause, problem = force.cause, force.cause.problem
    rows = ranked[(level["calibration"] * len(ranked)).astype(int)]
    values = {name: column[rows] for name, column in cause.values.items()}
    if "alpha" in level:
        values["alpha"] = np.quantile(cause.values["alpha"], level["alpha"])
    even = np.full(len(rows), 0.5)
    factor, zero = np.ones(len(rows)), np.zeros(len(rows))
    if "gear" in level:
        spread = new_member_sd(values["specimen_sd"], problem.specimens)
        factor = 1.0 + spread * ndtri(level["gear"])
    if force.tolerances:
        nominal = cause.posterior.case.gear.geometry
        shifts = {n: t * (2.0 * level[n] - 1.0) for n, t in force.tolerances.items()}
        made = shifted(nominal, shifts)
        ratio = stiffness_ratio(made, nominal, cause.posterior.theory)
        factor = factor * np.asarray(ratio)
    if "mounting" in level:
        spread = new_member_sd(values["run_offset_sd"], problem.runs)
        zero = spread * ndtri(level["mounting"])
    open_inputs = (ndtri(level.get(name, even)) for name in _UNTESTED)
    values[PLACES] = np.stack(list(open_inputs), axis=1)
    noise = level.get("noise", even)
    found = _member_forces(
        problem, values, force.whose, force.conditions, factor, noise
    )
    return np.asarray(found) + zero
