"""The readings that posterior draws expect at rows of a stream."""

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.errors import Finding, InputError
from hdcal.inference.distributions import moments
from hdcal.inference.force_model.discrepancy import Discrepancy
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.inference.force_model.values import Values, as_read
from hdcal.prediction.forces import force_of, grid_records
from hdcal.prediction.joint import DRIFTS, JointModel, join
from hdcal.prediction.models import Models, averaging_words, models_of
from hdcal.prediction.simulate import draw_scores

# At least this much probability must lie on models that a stream can follow.
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
class StreamDraws:
    """Draws of the models of a case that a stream can follow.

    Attributes:
        model: the models as one.
        values: parameters by site, [draw, …]; of a leftover discrepancy the mean.
        scores: coefficients of the leftover discrepancy, of unit variance, (draw, c).
        parts: weights that belong to each of these, shape (weight, c).
        bend: level of its law and normal score of each draw, (draw, 2).
    """

    model: JointModel
    values: Values
    scores: np.ndarray
    parts: np.ndarray
    bend: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness as read at the reference temperature [N/mm]."""
        problem = self.model.problem
        unit = float(problem.unit_stiffness) * problem.reading.radial_per_read
        return as_read(self.values, self.values["K"] * self.values["E0"] * unit)

    @property
    def variance(self) -> np.ndarray:
        """Variance of a reading without load, rounding included [N²]."""
        rounding = float(self.model.problem.step) ** 2 / 12.0
        return self.values["sigma"] ** 2 + rounding

    def take(self, rows: np.ndarray) -> "StreamDraws":
        """Return some of the draws, by ascending places."""
        values = {name: column[rows] for name, column in self.values.items()}
        model, scores, bend = self.model.take(rows), self.scores[rows], self.bend[rows]
        return replace(self, model=model, values=values, scores=scores, bend=bend)

    def at(self, deformation, temperature) -> RowForces:
        """Return what the draws expect at deformations [mm] and temperatures [°C]."""
        model, level = self.model, self.bend[:, 0]
        records = model.posterior.case.records
        low, high = np.min(records.deformation), np.max(records.deformation)
        warm = np.asarray(records.temperature)
        kelvins = temperature - np.clip(temperature, warm.min(), warm.max())
        _, near = model.bend(np.clip(deformation, low, high), level)
        mean, far = model.bend(deformation, level)
        # Inside the range each draw has a bend of its own, beyond it one unknown more.
        drifts = np.stack([model.drifts[name] for name in DRIFTS])
        shift = mean + near * self.bend[:, 1:] * np.where(deformation < 0.0, -1.0, 1.0)
        beyond = model.models[0].beyond(deformation)
        rows = np.stack([deformation, temperature, kelvins, beyond])
        found = _forces(model.problem, self.values, self.parts, drifts, rows)
        spread = np.sqrt(np.maximum(far**2 - near**2, 0.0)).T
        side = np.where(deformation > 0.5 * (low + high), 1.0, -1.0)
        outward = -1.0 if low + high < 0.0 else 1.0
        sign = side * outward * np.where(kelvins < 0.0, -1.0, 1.0)
        extrapolation = sign[:, None] * np.hypot(spread, found.extrapolation)
        return found._replace(mean=found.mean + shift.T, extrapolation=extrapolation)


def draws_of(models: Models) -> tuple[StreamDraws, list[str]]:
    """Return draws of the models that a stream can follow, and notes on all models.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: most of the probability lies on models that cannot be followed.
    """
    found, hidden = models_of(models), {}
    for model in found:
        for effect in model.posterior.effects:
            if effect.mixture or effect.needs - {"temperature"}:
                hidden[model.name] = f"a stream does not show its '{effect.name}'"
    followed = [model for model in found if model.name not in hidden]
    if sum(model.probability for model in followed) < _LEAST_FOLLOWED:
        remedy = "Calibrate without it, or diagnose blocks of rows"
        raise InputError(Finding("known", why, remedy) for why in hidden.values())
    notes = averaging_words(models)
    notes += [f"Model '{name}' is left out: {why}." for name, why in hidden.items()]
    if left := noise_warnings(followed[0].posterior):
        notes += [*left, "This may cause alarms without a change."]
    whole = join(followed)
    case, size, problem = whole.posterior.case, whole.size, whole.problem
    prior = followed[0].posterior.priors[MOUNTING]
    mounting = np.full(size, np.hypot(*moments(prior, MOUNTING)))
    # The error that a file states for its rows is noise of the stream.
    stated = np.mean(np.asarray(case.records.force_sd) ** 2)
    sigma = np.sqrt(whole.draws["sigma"] ** 2 + stated)
    values = {MOUNTING: mounting, **whole.draws, "sigma": sigma}
    scores, parts = np.empty((size, 0)), np.empty((0, 0))
    if problem.discrepancy is not None:
        at = np.asarray(case.records.deformation)
        mean, scores, parts = _leftover(problem.discrepancy, values, at)
        values |= {"gap_weights": mean}
    score = draw_scores(size, 0)
    bend = np.stack([score["law"], score["bend"]], axis=1)
    return StreamDraws(whole, values, scores, parts, bend), notes


def _leftover(discrepancy: Discrepancy, values: Values, at: np.ndarray):
    """Return mean weights of the leftover discrepancy, its scores and their parts."""
    weights = values["gap_weights"]
    fitted = np.any(weights != 0.0, axis=1)
    mean = fitted[:, None] * weights[fitted].mean(axis=0)
    left, size, axes = np.linalg.svd(weights - mean, full_matrices=False)
    root = np.sqrt(np.count_nonzero(fitted))
    parts = axes.T * (size / root)
    columns = np.asarray(discrepancy.columns(at, np.ones_like(at))) @ parts
    kept = np.abs(columns).max(axis=0) > _SMALL * np.median(values["sigma"])
    return mean, left[:, kept] * root, parts[:, kept]


@jax.jit
def _forces(problem: Problem, values: Values, parts, drifts, rows):
    at, warm, kelvins, beyond = rows
    records = grid_records(at, warm, jnp.where(at < 0.0, -1.0, 1.0), 0.0)
    draw = partial(_force, problem, parts, records, kelvins, beyond)
    return jax.vmap(draw, in_axes=(0, 2), out_axes=1)(values, drifts)


def _force(
    problem: Problem, parts, records, kelvins, beyond, value: Values, drifts
) -> RowForces:
    """Return the readings that one draw expects, without an axis of draws."""
    (zero, zero_sd), (frame, frame_sd) = drifts
    at = records.deformation

    def reading(factor):
        shifts = {"factor": factor, "moved": frame * kelvins}
        mean, noise = force_of(problem, value, records, **shifts)
        return mean + zero * kelvins, noise

    mean, slope, noise = jax.jvp(reading, (1.0,), (1.0,), has_aux=True)
    excess = jnp.exp(noise.log_weight) @ noise.sd**2 - value["sigma"] ** 2
    radial = value["K"] * value["E0"] * problem.unit_stiffness
    drift = jnp.abs(kelvins) * jnp.hypot(zero_sd, radial * frame_sd)
    if problem.discrepancy is None:
        columns = jnp.empty((len(at), 0))
        return RowForces(mean, slope, excess, drift, columns)
    weights = value["gap_weights"]
    # A stream does not show the direction: the loop of the leftover is noise.
    middle, up = (
        (1.0 - beyond)[:, None] * problem.discrepancy.columns(at, way + 0.0 * at)
        for way in (0.0, 1.0)
    )
    fitted = jnp.any(weights != 0.0)
    loop = (up - middle) @ jnp.column_stack([weights, fitted * parts])
    excess = excess + jnp.sum(loop**2, axis=1)
    columns = fitted * (middle @ parts)
    return RowForces(mean + middle @ weights, slope, excess, drift, columns)
