"""What the calibrated model leaves over, and whether it has a shape."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.answers.structure import Structure, Whitened, find_structure, shapes_of
from hdcal.inference.density import predict_rows
from hdcal.inference.distributions import frozen
from hdcal.inference.flat import sensitivity
from hdcal.inference.gap import prior_sd
from hdcal.inference.posterior import Posterior, gap_columns

# Draws that the fitted reading is averaged over: its error is then a tenth of the
# posterior's own.
_DRAWS = 200


@dataclass(frozen=True)
class Residuals:
    """Measured against fitted, row by row; the fit is the posterior mean reading.

    Attributes:
        deformation: as read [mm].
        temperature: of the specimen [°C].
        direction: sign of the last movement.
        run: index of the run.
        measured: force as read [N].
        fitted: mean reading [N].
        residual: measured − fitted [N].
        standardised: residual over the noise sd [-].
        structure: shapes that noise would rarely show.
    """

    deformation: np.ndarray
    temperature: np.ndarray
    direction: np.ndarray
    run: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    residual: np.ndarray
    standardised: np.ndarray
    structure: tuple[Structure, ...]


def residuals(posterior: Posterior) -> Residuals:
    """Return the residuals of a calibration and the shapes found in them."""
    problem, records = posterior.problem, posterior.case.records
    centre = {name: np.median(v, axis=0) for name, v in posterior.draws.items()}
    columns = gap_columns(problem, posterior.case)
    _, noise = predict_rows(problem, centre, records, columns)
    fitted = _fit(problem, _thinned(posterior.draws), records, columns)
    residual = np.asarray(records.force) - np.asarray(fitted)
    sd = np.sqrt(np.asarray(noise.sd[0]) ** 2 + problem.step**2 / 12.0)
    return Residuals(
        deformation=np.asarray(records.deformation),
        temperature=np.asarray(records.temperature),
        direction=np.asarray(records.sense),
        run=np.asarray(records.run),
        measured=np.asarray(records.force),
        fitted=np.asarray(fitted),
        residual=residual,
        standardised=residual / sd,
        structure=find_structure(_whiten(posterior, centre, columns, residual, sd), sd),
    )


def _thinned(draws: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    every = max(len(draws["K"]) // _DRAWS, 1)
    return {name: values[::every] for name, values in draws.items()}


@jax.jit
def _fit(problem, values, records, columns):
    """Return the posterior mean of each row's mean reading [N], draw after draw."""

    def add(total, value):
        return total + predict_rows(problem, value, records, columns)[0], None

    total, _ = jax.lax.scan(add, jnp.zeros(len(records.force)), values)
    return total / len(values["K"])


def _whiten(posterior: Posterior, centre, columns, residual, sd) -> Whitened:
    """Bring residuals, sensitivities and shapes to noise and prior sds."""
    problem, records = posterior.problem, posterior.case.records
    slopes = sensitivity(problem, centre, records, columns)
    table, pull = [], []
    for name, slope in slopes.items():
        law = frozen(posterior.priors[name])
        table.append(slope / sd * law.std())
        pull.append((law.mean() - centre[name]) / law.std())
    if columns is not None:
        scale = np.asarray(prior_sd(centre["gap_sd"], centre["gap_length"]))
        table += list((np.asarray(columns) * scale).T / sd)
        pull += list(-centre["gap_weights"] / scale)
    for index in range(problem.specimens):
        table.append(slopes["K"] * (records.specimen == index) / sd)
        pull.append(0.0)
    data, residual = np.stack(table, axis=1), residual / sd
    shapes = shapes_of(records, posterior.case.gear.reference_temperature)
    shapes = {n: (column / sd, up, down) for n, (column, up, down) in shapes.items()}
    if problem.runs:
        residual, data = (_demean(part, records.run) for part in (residual, data))
        shapes = {
            n: (_demean(c, records.run), up, down)
            for n, (c, up, down) in shapes.items()
        }
    below = np.zeros(len(pull))
    return Whitened(
        residual=np.concatenate([residual, pull]),
        absorbed=np.vstack([data, np.eye(len(pull))]),
        shapes={
            n: (np.concatenate([c, below]), up, down)
            for n, (c, up, down) in shapes.items()
        },
        free=problem.runs,
    )


def _demean(table: np.ndarray, groups) -> np.ndarray:
    """Take off the mean of each run, which has an offset of its own."""
    wide = table.reshape(len(table), -1)
    count = np.bincount(groups)
    means = np.stack([np.bincount(groups, column) / count for column in wide.T], 1)
    return (wide - means[groups]).reshape(table.shape)
