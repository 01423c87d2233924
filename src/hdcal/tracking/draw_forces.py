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
from hdcal.inference.distributions import sample_prior
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
        values: parameters by site, [draw, …]; of a leftover discrepancy the mean.
        model: number of the model of each draw, shape (draw,).
        scores: coefficients of the leftover discrepancy, of unit variance, (draw, c).
        parts: weights that belong to each of these, shape (weight, c).
        untested: what is unknown beyond the tested conditions.
    """

    case: Case
    problem: Problem
    values: Values
    model: np.ndarray
    scores: np.ndarray
    parts: np.ndarray
    untested: Untested

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

    def take(self, chosen: np.ndarray) -> "Draws":
        """Return some of the draws."""
        values = {name: column[chosen] for name, column in self.values.items()}
        scores, model = self.scores[chosen], self.model[chosen]
        return replace(self, values=values, scores=scores, model=model)

    def at(self, deformation, temperature) -> RowForces:
        """Return the readings that the draws expect.

        Args:
            deformation: as read, shape (n,) [mm].
            temperature: of the specimen, shape (n,) [°C].
        """
        rows = np.stack([deformation, temperature])
        return _forces(self.problem, self.values, self.parts, self.untested, rows)


def draws_of(models: Models, seed: int) -> tuple[Draws, list[str]]:
    """Return draws of the models that a stream can follow, and notes on all models.

    Args:
        models: a calibration, or several with probabilities.
        seed: of what is drawn from priors.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: most of the probability lies on models that cannot be followed.
    """
    followed, reasons, causes = [], {}, causes_of(models)
    for cause in causes:
        for effect in cause.posterior.effects:
            if effect.mixture or effect.needs - {"temperature"}:
                lacks = ", ".join(sorted(effect.needs)) or "outliers to be known"
                words = f"its effect '{effect.name}' needs {lacks}"
                reasons[cause.name] = f"{words}, which a stream of readings lacks"
        if cause.name not in reasons:
            followed.append(cause)
    if sum(cause.probability for cause in followed) < _LEAST_FOLLOWED:
        remedy = "Calibrate without it, or diagnose blocks of rows"
        raise InputError(Finding("known", why, remedy) for why in reasons.values())
    notes = averaging_words(causes)
    notes += [f"Model '{name}' is left out: {why}." for name, why in reasons.items()]
    if left := misfits(likeliest(followed).posterior):
        notes += [*left, "This may cause alarms without a change."]
    pooled = pool_causes(followed)
    values, untested = gear_values(pooled)
    case, site, rng = pooled.case, "run_offset_sd", np.random.default_rng(seed)
    mounting = {site: sample_prior(pooled.priors[site], site, rng, len(pooled.index))}
    mean, *leftover = _leftover(pooled.problem, values, case)
    values = mounting | values | mean
    # The error that a file states for its rows is noise of the stream.
    stated = np.mean(np.asarray(case.records.force_sd) ** 2)
    values["sigma"] = np.sqrt(values["sigma"] ** 2 + stated)
    parts = case, pooled.problem, values, pooled.index, *leftover, untested
    return Draws(*parts), notes


def _leftover(problem: Problem, values: Values, case: Case):
    """Return mean weights of the leftover discrepancy, its scores and their parts."""
    weights, discrepancy = values.get("gap_weights"), problem.discrepancy
    if weights is None or discrepancy is None:
        return {}, np.empty((len(values["K"]), 0)), np.empty((0, 0))
    fitted = np.any(weights != 0.0, axis=1)
    mean = fitted[:, None] * weights[fitted].mean(axis=0)
    left, size, axes = np.linalg.svd(weights - mean, full_matrices=False)
    root = np.sqrt(np.count_nonzero(fitted))
    scores, parts = left * root, axes.T * (size / root)
    at = np.asarray(case.records.deformation)
    columns = np.asarray(discrepancy.columns(at, np.ones_like(at))) @ parts
    kept = np.abs(columns).max(axis=0) > _SMALL * np.median(values["sigma"])
    return {"gap_weights": mean}, scores[:, kept], parts[:, kept]


@jax.jit
def _forces(problem: Problem, values: Values, parts, untested, rows):
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
