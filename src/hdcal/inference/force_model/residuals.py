"""Residuals of a calibration: systematic shapes, and tests of the noise."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtr, stdtr

from hdcal.data.records import Records
from hdcal.inference.checks import correlation_check
from hdcal.inference.distributions import moments
from hdcal.inference.force_model.discrepancy import discrepancy_columns
from hdcal.inference.force_model.identifiability import Linearisation, linearise
from hdcal.inference.force_model.noise_form import growth_p_value
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.residual_shapes import (
    FALSE_ALARM,
    Correlated,
    ResidualFinding,
    Whitened,
    find_structure,
    orthonormal,
    shapes_of,
)
from hdcal.inference.force_model.serial_correlation import (
    CORRELATION,
    previous_rows,
    whiten,
)
from hdcal.inference.force_model.values import predict_rows
from hdcal.inference.posterior import Posterior
from hdcal.quantities import Quantities
from hdcal.screening.local_fit import least_step
from hdcal.screening.turning_points import MEDIAN_SIZE

NEIGHBOURS, SCATTER, WILD = "neighbours", "scatter", "wild readings"
# Draws that the fitted reading is averaged over: its error is then a tenth of that of
# the posterior.
_DRAWS = 200
# Smallest number of rows for tests of the noise.
_LEAST_ROWS = 12
# Efficiency of the median of absolute errors.
_EFFICIENCY = 0.37
# An outlier deviates by at least so many sds. With less than this share of the sum of
# squares the largest one changes no result.
_OUTLIER, _SHARE = 12.0, 0.02


@dataclass(frozen=True)
class Residuals:
    """Measured less fitted, row by row; the fit is the posterior mean reading."""

    records: Records
    # In N, and in sds of the noise.
    residual: np.ndarray
    standardised: np.ndarray
    # Shapes that noise would rarely show, and differences from the noise of the model.
    structure: tuple[ResidualFinding, ...]
    noise: tuple[ResidualFinding, ...]
    units: Quantities
    contact: float  # deformation as read of the unloaded part [mm]


def residuals(posterior: Posterior) -> Residuals:
    """Return the residuals of a calibration and the shapes found in them."""
    problem, records = posterior.problem, posterior.case.records
    padded, units = pad_records(records), posterior.case.units
    columns = discrepancy_columns(problem.discrepancy, padded)
    every = max(len(posterior.draws["K"]) // _DRAWS, 1)
    thinned = {name: values[::every] for name, values in posterior.draws.items()}
    fitted = np.asarray(_fit(problem, thinned, padded, columns))
    residual = np.asarray(records.force) - fitted[: len(records.force)]
    centre = posterior.median
    near = linearise(problem, centre, records)
    whitened = _whiten(posterior, near, residual)
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
        records=records,
        residual=residual,
        standardised=residual / near.sd,
        structure=tuple(replace(s, words=units.say(s.words)) for s in structure),
        noise=tuple(replace(s, words=units.say(s.words)) for s in faults),
        units=units,
        contact=posterior.case.gear.contact,
    )


@jax.jit
def _fit(problem, values, records, columns):
    """Return the posterior mean of each row's mean reading [N], draw after draw."""

    def add(total, value):
        return total + predict_rows(problem, value, records, columns)[0], None

    total, _ = jax.lax.scan(add, jnp.zeros(len(records.force)), values)
    return total / len(values["K"])


def _whiten(posterior: Posterior, near: Linearisation, residual) -> Whitened:
    """Return residuals, sensitivities and shapes in noise and prior sds."""
    case, centre = posterior.case, posterior.median
    sd, priors = near.sd, posterior.effective_priors
    columns, prior_residual = [near.members], [*-near.scores]
    for name, slope in near.slopes.items():
        mean, prior_sd = moments(priors[name], name)
        columns.append(slope[:, None] * prior_sd)
        prior_residual.append((mean - centre[name]) / prior_sd)
    smoothed = case.screening is not None and case.screening.deformation_sd > 0.0
    reference = case.gear.reference_temperature
    shapes = shapes_of(case.records, reference, smoothed=smoothed)
    none = np.zeros(len(prior_residual))
    return Whitened(
        residual=np.concatenate([residual / sd, prior_residual]),
        absorbed=np.vstack([np.hstack(columns) / sd[:, None], np.eye(len(none))]),
        shapes={
            name: (np.concatenate([column / sd, none]), up, down)
            for name, (column, up, down) in shapes.items()
        },
    )


def noise_warnings(posterior: Posterior) -> tuple[str, ...]:
    """Return a warning for each fault of the noise, for answers that depend on it."""
    words = [fault.words for fault in residuals(posterior).noise]
    draws, rows = posterior.draws, len(posterior.case.records.force)
    correlation = correlation_check(draws, rows, posterior.priors)
    if correlation.outcome == "warning":
        words.append(f"{correlation.words[:1].upper()}{correlation.words[1:]}.")
    return tuple(words)


def noise_faults(
    data: Whitened,
    records: Records,
    sd: np.ndarray,
    *,
    rounded: bool,
    mixed: bool = False,
    correlation: float = 0.0,
) -> tuple[ResidualFinding, ...]:
    """Test whether residuals differ from the noise of the model.

    The family-wise error of the tests is `FALSE_ALARM`. `data` absorbs the shapes that
    were found; the noise sd of each row is in N. Where steps of the reading are wider
    than its noise (`rounded`), neighbours err in the same way without any correlation;
    a model that is `mixed` expects outliers.
    """
    if len(sd) < _LEAST_ROWS:
        return ()
    before = previous_rows(records)
    # Squares of correlated errors are correlated too, which raises false positives.
    left = _independent(data, before, correlation)
    rms = float(np.sqrt(np.mean((left.scaled * sd) ** 2)))
    words = "Readings scatter more at larger {load}s: bounds there are too low."
    p_value = growth_p_value(left.scaled**2, records.deformation)
    tests = [ResidualFinding(SCATTER, p_value, rms, words)]
    if not (rounded or mixed):
        innovation_sd = sd * np.sqrt(1.0 - correlation**2 * (before >= 0))
        tests.append(_outlier(left, records, innovation_sd))
    if not rounded and np.any(before >= 0):
        tests.append(_neighbours(left, before, sd, correlation))
    adjusted = [replace(t, p_value=min(1.0, t.p_value * len(tests))) for t in tests]
    return tuple(test for test in adjusted if test.p_value <= FALSE_ALARM)


class _Errors(NamedTuple):
    """Independent residuals without all that was absorbed, in noise sds."""

    # Orthonormal columns of all that was absorbed, (n + p, q).
    basis: np.ndarray
    # With the rows of the priors below those of the data, (n + p,).
    error: np.ndarray
    # Of the data's rows, of unit variance each, (n,).
    scaled: np.ndarray
    # Degrees of freedom.
    free: int


def _independent(data: Whitened, before: np.ndarray, correlation: float) -> _Errors:
    size = len(before)
    absorbed, residual = (
        np.concatenate([whiten(table[:size], before, correlation), table[size:]])
        for table in (data.absorbed, data.residual)
    )
    basis = orthonormal(absorbed)
    error = residual - basis @ (basis.T @ residual)
    kept = 1.0 - np.sum(basis[:size] ** 2, axis=1)
    scaled = error[:size] / np.sqrt(np.maximum(kept, 1e-6))
    return _Errors(basis, error, scaled, len(error) - basis.shape[1])


def _neighbours(
    left: _Errors, before, sd: np.ndarray, correlation: float
) -> ResidualFinding:
    """Test whether neighbours in a run are correlated more than in the model.

    The ratio of quadratic forms has its exact mean and variance under independence,
    as in Durbin and Watson, Biometrika 37 (1950).
    """
    size, (follows,) = len(sd), np.nonzero(before >= 0)

    def shifted(table: np.ndarray) -> np.ndarray:
        """Return half the row after and half the row before, within runs."""
        half = np.zeros_like(table)
        half[before[follows]] += 0.5 * table[follows]
        half[follows] += 0.5 * table[before[follows]]
        return half

    neighbours, free, pairs = shifted(left.basis), left.free, len(follows)
    products = left.basis.T @ neighbours
    trace = -float(np.trace(products))
    square = 0.5 * pairs - 2.0 * float(np.sum(neighbours**2))
    square += float(np.sum(products**2))
    ratio = float(left.error @ shifted(left.error) / (left.error @ left.error))
    mean = trace / free
    variance = 2.0 * (free * square - trace**2) / (free**2 * (free + 2.0))
    p = float(ndtr((mean - ratio) / np.sqrt(variance)))
    excess = float(np.clip((ratio - mean) * free / pairs, 0.0, 0.95))
    times = np.sqrt((1.0 + excess) / (1.0 - excess))
    rms = float(np.sqrt(np.mean((left.error[:size] * sd) ** 2)))
    beyond = f" beyond the model's {correlation:.2f}" if correlation >= 0.005 else ""
    words = (
        f"The errors of neighbouring readings are correlated ({excess:.2f}{beyond}): "
        f"the intervals of stiffness and mean {{load}} are some {times:.1f} times too "
        "narrow."
    )
    return ResidualFinding(NEIGHBOURS, p, excess * rms, words)


def _outlier(left: _Errors, records: Records, sd: np.ndarray) -> ResidualFinding:
    """Test whether a reading deviates more than noise can.

    The scale is the median of all errors, which a few outliers do not change, or the
    rounding of a display; `sd` [N] is that of each row given the one before.
    """
    size, far = len(sd), np.abs(left.scaled)
    rounding = least_step(np.asarray(records.force)) / np.sqrt(12.0)
    scale = np.maximum(float(np.median(far)) / MEDIAN_SIZE, rounding / sd)
    times = far / np.maximum(scale, 1e-300)
    p_value = 2.0 * size * stdtr(_EFFICIENCY * left.free, -times)
    row = int(np.argmax(far))
    outliers = np.flatnonzero((p_value <= FALSE_ALARM) & (times >= _OUTLIER))
    # The innovation of the row after an outlier is large as well.
    count = int(np.sum(np.diff(outliers, prepend=-2) > 1))
    dominates = far[row] ** 2 >= _SHARE * float(far @ far)
    is_outlier = count > 0 and dominates
    others = f" ({count} such readings)" if count > 1 else ""
    distance = float(far[row] * sd[row])
    force, deformation = (float(v[row]) for v in (records.force, records.deformation))
    words = (
        f"Reading {row + 1}, {force:.4g} {{N}} at {deformation:.4g} {{mm}}, deviates "
        f"by {distance:.3g} {{N}} from the fit, {times[row]:.0f} times the scatter of "
        f"the readings{others}: all results may be wrong."
    )
    return ResidualFinding(
        WILD, float(p_value[row]) if is_outlier else 1.0, distance, words
    )
