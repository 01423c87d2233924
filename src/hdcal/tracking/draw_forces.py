"""The readings that draws expect at rows of a stream, and the bank before the first."""

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import digamma

from hdcal.errors import Finding, InputError
from hdcal.inference.distributions import moments
from hdcal.inference.force_model.discrepancy import Discrepancy
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.force_model.values import Values, stiffness_as_read
from hdcal.prediction.forces import force_of, grid_records
from hdcal.prediction.joint import DRIFTS, JointModel, join
from hdcal.prediction.models import Models, averaging_words, models_of
from hdcal.prediction.simulate import draw_scores
from hdcal.tracking.bank import CELLS, Bank, RowForces

# At least this much probability must lie on models that a stream can follow.
_LEAST_FOLLOWED = 0.5
# Parts of a discrepancy below this share of the noise are left out.
_SMALL = 0.03
# Site of the sd of the zero from one mounting to the next [N].
MOUNTING = "run_offset_sd"
# Draws of the bank.
_DRAWS = 128
# Draws per coefficient that a regression needs, and fewest draws of a model.
_PER_COEFFICIENT = 10
# Largest variance of log σ² within a draw: a conjugate prior ties the width of the
# coefficients to the noise, and a lucky first reading would say that there is little.
_MOST_WITHIN = 0.1
# Pairs of neighbours that the correlation of a calibration counts for.
_PAIRS = 30.0


@dataclass(frozen=True)
class StreamDraws:
    """Draws of the models of a case that a stream can follow, joined.

    The weights of a discrepancy among the values are their mean; scores of
    unit variance (draw, c) times parts (weight, c) are the distances from it. The bend
    of each draw has the level of its law and a normal score, (draw, 2).
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
        return stiffness_as_read(
            self.values, self.values["K"] * self.values["E0"] * unit
        )

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
                hidden[model.name] = (
                    f"'{effect.name}' cannot be evaluated reading by reading"
                )
    followed = [model for model in found if model.name not in hidden]
    if sum(model.probability for model in followed) < _LEAST_FOLLOWED:
        remedy = "Calibrate without this effect, or diagnose blocks of rows"
        raise InputError(Finding("known", why, remedy) for why in hidden.values())
    notes = averaging_words(models)
    notes += [f"Model '{name}' is left out: {why}." for name, why in hidden.items()]
    if left := noise_warnings(followed[0].posterior):
        notes += [*left, "This may cause alarms without a change of the gear."]
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
        mean, scores, parts = _weights(problem.discrepancy, values, at)
        values |= {"gap_weights": mean}
    score = draw_scores(size, 0)
    bend = np.stack([score["law"], score["bend"]], axis=1)
    return StreamDraws(whole, values, scores, parts, bend), notes


def _weights(discrepancy: Discrepancy, values: Values, at: np.ndarray):
    """Return mean weights of the discrepancy, its scores and their parts."""
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
    # A stream does not show the direction: the loop of the discrepancy is noise.
    middle, up = (
        (1.0 - beyond)[:, None] * problem.discrepancy.columns(at, way + 0.0 * at)
        for way in (0.0, 1.0)
    )
    fitted = jnp.any(weights != 0.0)
    loop = (up - middle) @ jnp.column_stack([weights, fitted * parts])
    excess = excess + jnp.sum(loop**2, axis=1)
    columns = fitted * (middle @ parts)
    return RowForces(mean + middle @ weights, slope, excess, drift, columns)


def first_bank(every: StreamDraws, threshold: float) -> tuple[StreamDraws, Bank]:
    """Return some of the draws, and what they know of a stream."""
    number, problem = every.model.number, every.model.problem
    rows = np.flatnonzero(np.bincount(number)[number] >= _PER_COEFFICIENT)
    rows = rows[np.linspace(0, len(rows) - 1, _DRAWS).astype(int)]
    draws = every.take(rows)
    mean, covariance = _coefficients(every, rows)
    new = 1.0 + 1.0 / (problem.runs or 1), 1.0 + 1.0 / (problem.specimens or 1)
    covariance[:, 1, 1] += new[0] * draws.values[MOUNTING] ** 2
    covariance[:, 0, 0] += new[1] * draws.values.get("specimen_sd", 0.0) ** 2
    logs = np.log(every.variance)
    logs -= (np.bincount(number, logs) / np.maximum(np.bincount(number), 1))[number]
    spread = max(float(np.var(logs)), 1e-8)
    within = min(spread, _MOST_WITHIN)
    # ψ′(shape) = within, to its second order.
    shape = 0.5 * (1.0 + np.sqrt(1.0 + 2.0 * within)) / within
    # What is not within is between the draws.
    moved = (np.sqrt(1.0 - within / spread) - 1.0) * logs[rows]
    rate = draws.variance * np.exp(moved + digamma(shape))
    step, rho = float(problem.step), np.mean(every.values.get(CORRELATION, 0.0))
    state = {
        "mean": mean,
        "covariance": covariance / (rate / (shape - 1.0))[:, None, None],
        "shape": shape,
        "rate": rate,
        "log_weight": np.full(_DRAWS, -np.log(_DRAWS)),
        "columns": np.zeros_like(mean),
        "reading": np.zeros(_DRAWS),
        "products": _PAIRS * np.array([rho, 1.0]),
        "sums": np.zeros(2),
        "counts": np.zeros(CELLS if step else 0),
        "stiffness": draws.stiffness,
        "variance": rate / shape,
        "step": step,
        "remounting": 2.0 * np.mean(every.values[MOUNTING] ** 2),
        "threshold": threshold,
    }
    arrays = {name: jnp.asarray(value, float) for name, value in state.items()}
    return draws, Bank(**arrays, epoch=jnp.zeros((), int))


def _coefficients(
    every: StreamDraws, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance of the coefficients given the shape of each draw.

    By linear regression within each model on the values that shape the curve. The last
    two coefficients are of untested conditions, independent and of unit variance.
    """
    values, stiffness = every.values, every.stiffness
    names = ["alpha", "deformation_offset", *(n for n in values if "." in n)]
    shapes = np.stack([values[name] for name in names], axis=1)
    target = np.column_stack([stiffness, values["force_offset"], every.scores])
    size = target.shape[1]
    mean = np.zeros((_DRAWS, size + 2))
    covariance = np.tile(np.eye(size + 2), (_DRAWS, 1, 1))
    number = every.model.number
    for model in np.unique(number[rows]):
        of, here = number == model, number[rows] == model
        about = shapes - shapes[of].mean(axis=0)
        left = target[of] - target[of].mean(axis=0)
        slope, _, rank, _ = np.linalg.lstsq(about[of], left, rcond=1e-10)
        if len(left) < _PER_COEFFICIENT * (size + rank):
            slope, rank = np.zeros_like(slope), 0
        left = left - about[of] @ slope
        mean[here, :size] = target[of].mean(axis=0) + about[rows[here]] @ slope
        covariance[here, :size, :size] = left.T @ left / (len(left) - 1 - rank)
    # Stiffness relative to that of the draw, zero from that of the draw.
    mean[:, 1] -= values["force_offset"][rows]
    unit = np.ones_like(mean)
    unit[:, 0] = 1.0 / stiffness[rows]
    return mean * unit, covariance * unit[:, :, None] * unit[:, None, :]
