"""What the calibrated model leaves over, and whether it has a shape."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.checks import correlation_check
from hdcal.inference.discrepancy import discrepancy_columns
from hdcal.inference.distributions import moments
from hdcal.inference.linearisation import Linearisation, linearise
from hdcal.inference.padding import pad_records
from hdcal.inference.posterior import HYPOTHESIS, Posterior
from hdcal.inference.problem import Problem
from hdcal.inference.residual_noise import noise_faults
from hdcal.inference.residual_shapes import (
    Correlated,
    Structure,
    Whitened,
    find_structure,
    shapes_of,
)
from hdcal.inference.serial_correlation import CORRELATION, previous_rows
from hdcal.inference.values import correlation_of, predict_rows
from hdcal.notebook import Shown
from hdcal.quantities import FORCE, Quantities

# Draws that the fitted reading is averaged over: its error is then a tenth of the
# posterior's own.
_DRAWS = 200

# How a warning begins that a shape is left in the residuals.
SHAPED = "This takes the model's shape for right, but its residuals have one."
_DIAGNOSE = "Diagnose", "Diagnose, or calibrate with a gap"
_BESIDE = "That is left out, and little beside the noise."
# Share of the noise below which a shape widens what one reading does by a twentieth.
_SMALL = 1.0 / 3.0
UNNAMED = "No cause named makes it"
_DIAGNOSED = UNNAMED, f"{UNNAMED}: calibrate with a gap"


@dataclass(frozen=True, repr=False)
class Residuals(Shown):
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
        noise: in which ways the rest is not the noise that the model has.
        units: names and units of what was measured.
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
    noise: tuple[Structure, ...]
    units: Quantities = FORCE


def residuals(posterior: Posterior) -> Residuals:
    """Return the residuals of a calibration and the shapes found in them."""
    problem, records = posterior.problem, posterior.case.records
    padded = pad_records(records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    fitted = _fit(problem, _thinned(posterior.draws), padded, columns)
    fitted = np.asarray(fitted)[: len(records.force)]
    residual = np.asarray(records.force) - fitted
    centre = {name: np.median(v, axis=0) for name, v in posterior.draws.items()}
    near = linearise(problem, centre, records)
    whitened = _whiten(posterior, centre, near, residual)
    structure = find_structure(whitened, near.sd, _noise(problem, records))
    shapes = [whitened.shapes[shape.name][0] for shape in structure]
    rest = replace(whitened, absorbed=np.column_stack([whitened.absorbed, *shapes]))
    coarse = float(problem.step) > float(np.median(near.sd))
    noise = noise_faults(
        rest,
        records,
        near.sd,
        rounded=coarse,
        mixed=any(effect.mixture for effect in posterior.effects),
        correlation=float(correlation_of(centre)),
    )
    return Residuals(
        deformation=np.asarray(records.deformation),
        temperature=np.asarray(records.temperature),
        direction=np.asarray(records.sense),
        run=np.asarray(records.run),
        measured=np.asarray(records.force),
        fitted=fitted,
        residual=residual,
        standardised=residual / near.sd,
        structure=_said(structure, posterior),
        noise=_said(noise, posterior),
        units=posterior.case.units,
    )


def _said(found: tuple[Structure, ...], posterior: Posterior) -> tuple[Structure, ...]:
    units = posterior.case.units
    return tuple(replace(one, words=units.say(one.words)) for one in found)


def _thinned(draws: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    every = max(len(draws["K"]) // _DRAWS, 1)
    return {name: values[::every] for name, values in draws.items()}


@jit
def _fit(problem, values, records, columns):
    """Return the posterior mean of each row's mean reading [N], draw after draw."""

    def add(total, value):
        return total + predict_rows(problem, value, records, columns)[0], None

    total, _ = jax.lax.scan(add, jnp.zeros(len(records.force)), values)
    return total / len(values["K"])


def _noise(problem: Problem, records: Records) -> Correlated | None:
    if not problem.correlated:
        return None
    return Correlated(previous_rows(records), problem.priors[CORRELATION])


def _whiten(posterior: Posterior, centre, near: Linearisation, residual) -> Whitened:
    """Bring residuals, sensitivities and shapes to noise and prior sds."""
    records, sd = posterior.case.records, near.sd
    priors = posterior.problem.priors_given(centre)
    table, pull = [near.members], [-near.place]
    for name, slope in near.slopes.items():
        mean, prior_sd = moments(priors[name], name)
        table.append(slope[:, None] * prior_sd)
        pull.append(np.array([(mean - centre[name]) / prior_sd]))
    below = np.concatenate(pull)
    shapes = shapes_of(records, posterior.case.gear.reference_temperature)
    return Whitened(
        residual=np.concatenate([residual / sd, below]),
        absorbed=np.vstack(
            [np.concatenate(table, axis=1) / sd[:, None], np.eye(len(below))]
        ),
        shapes={
            name: (np.concatenate([column / sd, np.zeros(len(below))]), up, down)
            for name, (column, up, down) in shapes.items()
        },
    )


def misfits(posterior: Posterior, *, shapes: bool = True) -> tuple[str, ...]:
    """Return a warning for all that the model left in the residuals.

    For answers that take the model for right. A leftover discrepancy has taken what
    depends on the deformation alone; a loop, for one, it cannot take. Noise that is so
    correlated that intervals are too narrow is told too.

    Args:
        posterior: from `calibrate`.
        shapes: whether to warn of them.
    """
    left = residuals(posterior)
    alike = correlation_check(posterior.draws, len(posterior.case.records.force))
    remedies = _DIAGNOSED if HYPOTHESIS in posterior.settings else _DIAGNOSE
    remedy = remedies[posterior.problem.discrepancy is None]
    noise_sd = float(np.median(posterior.draws["sigma"]))
    told = left.structure if shapes else ()
    large = [shape for shape in told if shape.size_N > _SMALL * noise_sd]
    return (
        *(f"{SHAPED} {shape.words.rstrip('.')}. {remedy}." for shape in large),
        *(f"{shape.words} {_BESIDE}" for shape in told if shape not in large),
        *(fault.words for fault in left.noise),
        *(
            [f"{alike.words[:1].upper()}{alike.words[1:]}."]
            if alike.outcome == "warning"
            else []
        ),
    )
