"""The readings that posterior draws expect at rows of a stream.

The only file of this folder that depends on how the prediction engine computes.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.case import Case
from hdcal.data.records import Array
from hdcal.errors import Finding, InputError
from hdcal.inference.discrepancy import Discrepancy
from hdcal.inference.distributions import moments
from hdcal.inference.gauges import as_read
from hdcal.inference.problem import Problem
from hdcal.inference.residuals import misfits
from hdcal.inference.values import Values
from hdcal.prediction.engine.causes import averaging_words, causes_of, likeliest
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.gear_forces import CAUSE, gear_values
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import pool_causes
from hdcal.prediction.engine.untested import Untested

# Models with more than this probability have to be ones that a stream can follow.
_LEAST_FOLLOWED = 0.5
# Parts of a leftover discrepancy below this share of the noise are left out.
_SMALL = 0.03
# Site of the sd of the zero from one mounting to the next [N].
MOUNTING = "run_offset_sd"


class RowForces(NamedTuple):
    """Readings that draws expect at rows.

    Attributes:
        mean: reading [N].
        slope: its derivative by the stiffness, relative to that of the draw [N].
        excess: variance of a reading beyond that of one without load [N²].
        extrapolation: sd of the error at untested conditions, with the sign of the side
            on which these lie [N].
        columns: of the coefficients of the leftover discrepancy [N].
    """

    mean: Float[Array, "n draw"]
    slope: Float[Array, "n draw"]
    excess: Float[Array, "n draw"]
    extrapolation: Float[Array, "n draw"]
    columns: Float[Array, "n draw c"]


@dataclass(frozen=True)
class Draws:
    """Draws of the models of a case.

    Attributes:
        case: that was calibrated.
        problem: structure of the model with all effects.
        untested: what is unknown beyond the tested conditions.
        model: number of the model of each draw, shape (draw,).
        values: parameters by site, [draw, …]; of a leftover discrepancy the mean.
        scores: coefficients of the leftover discrepancy, of unit variance, (draw, c).
        parts: weights that belong to each of these, shape (weight, c).
    """

    case: Case
    problem: Problem
    untested: Untested
    model: np.ndarray
    values: Values
    scores: np.ndarray
    parts: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness as read at the reference temperature [N/mm]."""
        unit = float(self.problem.unit_stiffness) * self.problem.reading.radial_per_read
        return as_read(self.values, self.values["K"] * self.values["E0"] * unit)

    @property
    def variance(self) -> np.ndarray:
        """Variance of a reading without load, rounding included [N²]."""
        rounding = float(self.problem.step) ** 2 / 12.0
        return self.values["sigma"] ** 2 + rounding

    def take(self, rows: np.ndarray) -> "Draws":
        """Return some of the draws."""
        values = {name: column[rows] for name, column in self.values.items()}
        scores, model = self.scores[rows], self.model[rows]
        return replace(self, values=values, scores=scores, model=model)

    def at(self, deformation, temperature) -> RowForces:
        """Return the readings expected at deformations [mm] and temperatures [°C]."""
        rows = np.stack([deformation, temperature])
        return _forces(self.problem, self.values, self.parts, self.untested, rows)


def draws_of(models: Models) -> tuple[Draws, list[str]]:
    """Return draws of the models that a stream can follow, and notes on all models.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: most of the probability lies on models that cannot be followed.
    """
    causes, hidden = causes_of(models), {}
    for cause in causes:
        for effect in cause.posterior.effects:
            if effect.mixture or effect.needs - {"temperature"}:
                hidden[cause.name] = f"a stream does not show its '{effect.name}'"
    followed = [cause for cause in causes if cause.name not in hidden]
    if sum(cause.probability for cause in followed) < _LEAST_FOLLOWED:
        remedy = "Calibrate without it, or diagnose blocks of rows"
        raise InputError(Finding("known", why, remedy) for why in hidden.values())
    notes = averaging_words(causes)
    notes += [f"Model '{name}' is left out: {why}." for name, why in hidden.items()]
    if left := misfits(likeliest(followed).posterior):
        notes += [*left, "This may cause alarms without a change."]
    pooled = pool_causes(followed)
    values, untested = gear_values(pooled)
    case, model, size = pooled.case, pooled.index, len(pooled.index)
    mounting = np.full(size, np.hypot(*moments(pooled.priors[MOUNTING], MOUNTING)))
    # The error that a file states for its rows is noise of the stream.
    stated = np.mean(np.asarray(case.records.force_sd) ** 2)
    sigma = np.sqrt(values["sigma"] ** 2 + stated)
    values = {MOUNTING: mounting, **values, "sigma": sigma}
    scores, parts = np.empty((size, 0)), np.empty((0, 0))
    if pooled.problem.discrepancy is not None:
        mean, scores, parts = _leftover(pooled.problem.discrepancy, values, case)
        values |= {"gap_weights": mean}
    return Draws(case, pooled.problem, untested, model, values, scores, parts), notes


def _leftover(discrepancy: Discrepancy, values: Values, case: Case):
    """Return mean weights of the leftover discrepancy, its scores and their parts."""
    weights = values["gap_weights"]
    fitted = np.any(weights != 0.0, axis=1)
    mean = fitted[:, None] * weights[fitted].mean(axis=0)
    left, size, axes = np.linalg.svd(weights - mean, full_matrices=False)
    root = np.sqrt(np.count_nonzero(fitted))
    at = np.asarray(case.records.deformation)
    parts = axes.T * (size / root)
    columns = np.asarray(discrepancy.columns(at, np.ones_like(at))) @ parts
    kept = np.abs(columns).max(axis=0) > _SMALL * np.median(values["sigma"])
    return mean, left[:, kept] * root, parts[:, kept]


@jax.jit
def _forces(problem: Problem, values: Values, parts, untested: Untested, rows):
    at, warm = rows
    records = grid_records(at, warm, jnp.where(at < 0.0, -1.0, 1.0), 0.0)
    draw = partial(_force, problem, parts, untested, records)
    return jax.vmap(draw, out_axes=1)(values)


def _force(problem: Problem, parts, untested, records, value: Values) -> RowForces:
    """Return the readings that one draw expects, without an axis of draws."""
    at = records.deformation
    beyond = jax.tree.map(lambda leaf: leaf[value[CAUSE]], untested)
    kelvins = beyond.kelvins(records.temperature)
    zero, moved = (mean * kelvins for mean, _ in (beyond.zero, beyond.frame))

    def reading(factor):
        shifts = {"factor": factor, "zero": zero, "moved": moved}
        return force_of(problem, value, records, **shifts)

    mean, slope, noise = jax.jvp(reading, (1.0,), (1.0,), has_aux=True)
    excess = jnp.exp(noise.log_weight) @ noise.sd**2 - value["sigma"] ** 2
    bends = beyond.bends(value)
    bend, sd, share = bends.law(at)
    mean = mean + share * bend
    radial = value["K"] * value["E0"] * problem.unit_stiffness
    drift = kelvins * jnp.hypot(beyond.zero[1], radial * beyond.frame[1])
    centre = (bends.above.growth.far + bends.above.growth.end) / 2.0
    is_near = (share > 0.0) & ((at - centre) * centre < 0.0)
    sign = jnp.where(is_near, -1.0, 1.0) * jnp.where(kelvins < 0.0, -1.0, 1.0)
    extrapolation = sign * jnp.hypot(share * sd, drift)
    if problem.discrepancy is None:
        columns = jnp.empty((len(at), 0))
        return RowForces(mean, slope, excess, extrapolation, columns)
    weights = value["gap_weights"]
    # A stream does not show the direction: the loop of the leftover is noise.
    middle, up = (
        (1.0 - share)[:, None] * problem.discrepancy.columns(at, way + 0.0 * at)
        for way in (0.0, 1.0)
    )
    loop = (up - middle) @ jnp.column_stack([weights, parts])
    excess = excess + jnp.sum(loop**2, axis=1)
    columns = jnp.any(weights != 0.0) * (middle @ parts)
    return RowForces(mean + middle @ weights, slope, excess, extrapolation, columns)
