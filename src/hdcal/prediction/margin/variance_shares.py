"""Shares of the variance of one future member's force, by what brings them.

Sobol's shares assume independent inputs. Stiffness and zeros are tied together by the
data, and of K and E₀ only the product is known: all of these are one input, the draw.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats
from scipy.special import ndtri

from hdcal.prediction.mixture import Mixture
from hdcal.prediction.population_force import Outlook, leftover, member_force
from hdcal.prediction.size_tolerances import relative_stiffness

Driver = Literal["data", "prior", "given"]
# Points of each input's sample; a power of two.
_POINTS = 4096
# Largest correlation at which α counts as an input of its own.
_INDEPENDENT = 0.2


@dataclass(frozen=True)
class Share:
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


@jax.jit
def _mean_forces(problem, values, question, temperature):
    """Return the mean force of every draw [N], scatter and noise left out."""

    def one(value):
        force, _ = member_force(problem, value, question, temperature, "reading", 1.0)
        return force

    return jax.vmap(one)(values)


@partial(jax.jit, static_argnames=("quantity",))
def _sampled(problem, values, question, temperature, factor, level, *, quantity):
    """Return forces with their noise at given levels of it, each of a draw of its own.

    Args:
        problem: of the model.
        values: [point, …] by name.
        question: where.
        temperature: of the specimen [°C].
        factor: of the stiffness, [point].
        level: of the noise, [point].
        quantity: which force.
    """

    def one(value, factor, level):
        force, (log_weight, sd) = member_force(
            problem, value, question, temperature, quantity, factor
        )
        law = Mixture(jnp.exp(log_weight), jnp.zeros_like(sd), sd)
        noise = law.quantile(level) if quantity == "reading" else 0.0
        return force + leftover(problem, value, question) + noise

    return jax.vmap(one)(values, factor, level)


def shares(
    outlooks: Sequence[tuple[float, Outlook]],
    temperature: float,
    tolerances: dict[str, float],
    seed: int = 0,
) -> tuple[Share, ...]:
    """Return Sobol's first-order and total shares of one future member's force.

    Args:
        outlooks: of each model, with its probability.
        temperature: of the specimen [°C].
        tolerances: ± by field [mm].
        seed: of the sample.
    """
    inputs = _inputs(outlooks, temperature, tolerances)
    names = list(inputs)
    if len(names) < 2:
        return tuple(Share(name, 1.0, 1.0, inputs[name]) for name in names)
    ranked = [_ranked(outlook, temperature) for _, outlook in outlooks]
    chances = np.cumsum([share for share, _ in outlooks])

    def force(points: np.ndarray) -> np.ndarray:
        blocks = np.split(points, points.shape[1] // _POINTS, axis=1)
        return np.concatenate([one_block(block) for block in blocks])[None]

    def one_block(block: np.ndarray) -> np.ndarray:
        level = dict(zip(names, np.clip(block, 1e-9, 1.0 - 1e-9), strict=True))
        found = np.zeros(block.shape[1])
        cause = level.get("cause", np.zeros(block.shape[1]))
        model = np.searchsorted(chances[:-1], cause, side="right")
        for index, (_, outlook) in enumerate(outlooks):
            here = _forces(outlook, ranked[index], temperature, tolerances, level)
            found = np.where(model == index, here, found)
        return found

    uniform = [stats.uniform() for _ in names]
    index = stats.sobol_indices(func=force, n=_POINTS, dists=uniform, rng=seed)
    first, total = np.ravel(index.first_order), np.ravel(index.total_order)
    return tuple(
        Share(name, float(first[i]), float(total[i]), inputs[name])
        for i, name in enumerate(names)
    )


def _ranked(outlook: Outlook, temperature: float) -> np.ndarray:
    """Return the draws in the order of their mean force: a smooth single input."""
    force = _mean_forces(
        outlook.posterior.problem, dict(outlook.values), outlook.question, temperature
    )
    return np.argsort(np.asarray(force), kind="stable")


def _driver(outlook: Outlook, name: str) -> Driver:
    found = outlook.posterior.diagnoses.get(name)
    return "data" if found is not None and found.driven_by == "data" else "prior"


def alpha_stands_alone(outlook: Outlook) -> bool:
    """Tell whether α is the prior's, and tied to nothing else by the data."""
    draws = outlook.values
    if _driver(outlook, "alpha") == "data" or np.ptp(draws["alpha"]) == 0.0:
        return False
    tied = np.corrcoef(draws["alpha"], draws["stiffness"])[0, 1]
    return bool(abs(tied) < _INDEPENDENT)


def _inputs(outlooks, temperature: float, tolerances) -> dict[str, Driver]:
    """Return the inputs that matter, and what drives each."""
    first = outlooks[0][1]
    problem, question = first.posterior.problem, first.question
    found: dict[str, Driver] = {"calibration": "data"}
    if len(outlooks) > 1:
        found["cause"] = "data"
    rise = temperature - first.posterior.case.gear.reference_temperature
    if rise and all(alpha_stands_alone(outlook) for _, outlook in outlooks):
        found["alpha"] = "prior"
    if first.quantity == "reading":
        found["noise"] = _driver(first, "sigma")
        if first.population != "readings" and problem.runs:
            found["mounting"] = _driver(first, "run_offset_sd")
    if first.population == "specimens":
        found["gear"] = _driver(first, "specimen_sd")
    found |= dict.fromkeys(tolerances, "given")
    if not question.low <= question.deformation <= question.high:
        fitted = all(o.posterior.problem.discrepancy is not None for _, o in outlooks)
        found["leftover"] = _driver(first, "gap_sd") if fitted else "prior"
    return found


def _forces(outlook: Outlook, ranked, temperature, tolerances, level) -> np.ndarray:
    """Return the force at levels, between 0 and 1, of every input."""
    problem = outlook.posterior.problem
    geometry, theory = outlook.posterior.case.gear.geometry, outlook.posterior.theory
    size = len(ranked)
    rows = ranked[(level["calibration"] * size).astype(int)]
    values = {name: column[rows] for name, column in outlook.values.items()}
    if "alpha" in level:
        values["alpha"] = np.quantile(outlook.values["alpha"], level["alpha"])
    even = np.full(len(rows), 0.5)
    standard = {n: ndtri(level.get(n, even)) for n in ("mounting", "gear", "leftover")}
    # New members stray from the mean of the tested, which strays from the centre.
    factor = np.ones(len(rows))
    if "gear" in level:
        spread = values["specimen_sd"] * np.sqrt(1.0 + 1.0 / problem.specimens)
        factor = 1.0 + spread * standard["gear"]
    shifts = {n: t * (2.0 * level[n] - 1.0) for n, t in tolerances.items()}
    if shifts:
        factor = factor * np.asarray(relative_stiffness(geometry, shifts, theory))
    zero = np.zeros(len(rows))
    if "mounting" in level:
        spread = values["run_offset_sd"] * np.sqrt(1.0 + 1.0 / problem.runs)
        zero = spread * standard["mounting"]
    values["_standard"] = np.stack([zero, zero, standard["leftover"]], axis=1)
    force = _sampled(
        problem,
        values,
        outlook.question,
        temperature,
        factor,
        level.get("noise", even),
        quantity=outlook.quantity,
    )
    return np.asarray(force) + zero
