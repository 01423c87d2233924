"""What the calibrated model leaves over, and whether it has a shape."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.exported import jit
from hdcal.inference.checks import correlation_check
from hdcal.inference.discrepancy import discrepancy_columns
from hdcal.inference.distributions import moments
from hdcal.inference.identifiability import Linearisation, linearise
from hdcal.inference.padding import pad_records
from hdcal.inference.posterior import Posterior
from hdcal.inference.residual_noise import noise_faults
from hdcal.inference.residual_shapes import (
    Correlated,
    Structure,
    Whitened,
    find_structure,
    shapes_of,
)
from hdcal.inference.serial_correlation import CORRELATION, previous_rows
from hdcal.inference.values import predict_rows
from hdcal.notebook import Shown
from hdcal.quantities import FORCE, Quantities

# Draws that the fitted reading is averaged over: its error is then a tenth of the
# posterior's own.
_DRAWS = 200


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
    every = max(len(posterior.draws["K"]) // _DRAWS, 1)
    thinned = {name: values[::every] for name, values in posterior.draws.items()}
    fitted = np.asarray(_fit(problem, thinned, padded, columns))[: len(records.force)]
    residual = np.asarray(records.force) - fitted
    centre = posterior.median
    near = linearise(problem, centre, records)
    whitened = _whiten(posterior, centre, near, residual)
    noise = None
    if problem.correlated:
        noise = Correlated(previous_rows(records), problem.priors[CORRELATION])
    structure = find_structure(whitened, near.sd, noise)
    shapes = [whitened.shapes[shape.name][0] for shape in structure]
    rest = replace(whitened, absorbed=np.column_stack([whitened.absorbed, *shapes]))
    faults = noise_faults(
        rest,
        records,
        near.sd,
        rounded=float(problem.step) > float(np.median(near.sd)),
        mixed=any(effect.mixture for effect in posterior.effects),
        correlation=float(centre.get(CORRELATION, 0.0)),
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
        structure=_in_words(structure, posterior.case.units),
        noise=_in_words(faults, posterior.case.units),
        units=posterior.case.units,
    )


def _in_words(found: tuple[Structure, ...], units: Quantities):
    return tuple(replace(one, words=units.say(one.words)) for one in found)


@jit
def _fit(problem, values, records, columns):
    """Return the posterior mean of each row's mean reading [N], draw after draw."""

    def add(total, value):
        return total + predict_rows(problem, value, records, columns)[0], None

    total, _ = jax.lax.scan(add, jnp.zeros(len(records.force)), values)
    return total / len(values["K"])


def _whiten(posterior: Posterior, centre, near: Linearisation, residual) -> Whitened:
    """Return residuals, sensitivities and shapes in noise and prior sds."""
    sd, priors = near.sd, posterior.problem.priors_given(centre)
    columns, pull = [near.members], [-near.place]
    for name, slope in near.slopes.items():
        mean, prior_sd = moments(priors[name], name)
        columns.append(slope[:, None] * prior_sd)
        pull.append(np.array([(mean - centre[name]) / prior_sd]))
    below = np.concatenate(pull)
    case = posterior.case
    smoothed = case.screening is not None and case.screening.deformation_sd > 0.0
    reference = case.gear.reference_temperature
    shapes = shapes_of(case.records, reference, smoothed=smoothed)
    return Whitened(
        residual=np.concatenate([residual / sd, below]),
        absorbed=np.vstack([np.hstack(columns) / sd[:, None], np.eye(len(below))]),
        shapes={
            name: (np.concatenate([column / sd, 0.0 * below]), up, down)
            for name, (column, up, down) in shapes.items()
        },
    )


def noise_warnings(posterior: Posterior) -> tuple[str, ...]:
    """Return a warning for each fault of the noise, for answers that rest on it.

    A shape of the residuals is no such fault: what is predicted has a bend for it.

    Args:
        posterior: from `calibrate`.
    """
    words = [fault.words for fault in residuals(posterior).noise]
    alike = correlation_check(posterior.draws, len(posterior.case.records.force))
    if alike.outcome == "warning":
        words.append(f"{alike.words[:1].upper()}{alike.words[1:]}.")
    return tuple(words)
