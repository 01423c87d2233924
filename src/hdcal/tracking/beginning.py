"""What a tracker begins with: its prior, its core, and rows such as will come."""

from collections.abc import Callable

import numpy as np

from hdcal.data.case import Gear
from hdcal.prediction.engine.pooled import Pooled
from hdcal.tracking.cause_cores import CauseCores, followed_one_by_one
from hdcal.tracking.effect_tracking import build_particles, force_effects
from hdcal.tracking.first_rows import FirstRows
from hdcal.tracking.linear_core import LinearCore
from hdcal.tracking.normal_inverse_gamma import match_draws
from hdcal.tracking.stream_prior import (
    StreamPrior,
    prior_from_gear,
    prior_from_posterior,
)
from hdcal.tracking.unequal_rows import UnequalRows


def begin_prior(known: Pooled | Gear, seed: int) -> StreamPrior:
    """Return what is known before the first row."""
    if isinstance(known, Gear):
        return prior_from_gear(known, seed)
    return prior_from_posterior(known, seed)


def begin_core(
    known: Pooled | Gear,
    prior: StreamPrior,
    forget: float,
    unequal: UnequalRows | None,
) -> tuple[LinearCore | FirstRows | CauseCores, Callable[..., np.ndarray]]:
    """Return the core, and what makes of a row the columns that it takes.

    Args:
        known: what the stream begins with.
        prior: of the stream, from the same.
        forget: share of the past kept at each reading.
        unequal: what readings have beside the model; None of a gear.

    Raises:
        InputError: the calibration holds what cannot be followed row by row.
    """
    coefficients = prior.coefficients()
    if isinstance(known, Gear):
        return FirstRows(coefficients, prior.variance), _linear_columns
    columns = _linear_columns
    if force_effects(known):
        core, columns = build_particles(known, prior, forget)
    elif forget == 1.0 and prior.cause.any():
        core = followed_one_by_one(coefficients, prior.variance, prior.cause)
    else:
        core = LinearCore(match_draws(coefficients, prior.variance), forget)
    if unequal is None or known.problem.discrepancy is None:
        return core, columns

    def with_leftover(deformation: float, rise: float, time: float) -> np.ndarray:
        found = columns(deformation, rise, time)
        fitted = unequal.leftover(np.array([deformation]))[0]
        fitted = np.broadcast_to(fitted, (*found.shape[:-1], len(fitted)))
        return np.concatenate([found, fitted], axis=-1)

    return core, with_leftover


def usual_design(
    known: Pooled | Gear, prior: StreamPrior, unequal: UnequalRows | None
) -> np.ndarray:
    """Return columns of rows such as will come, without effects, shape (row, p).

    Args:
        known: what the stream begins with.
        prior: of the stream, from the same.
        unequal: what readings have beside the model; None of a gear.
    """
    if isinstance(known, Gear):
        # The scale of deformations matters little.
        deformation = np.linspace(0.0, known.full_scale.deformation, 50)
        rise, fitted = np.zeros(50), np.empty((50, 0))
    else:
        deformation = np.asarray(known.case.records.deformation)
        rise = np.asarray(known.case.records.temperature)
        rise = rise - prior.reading.reference_temperature
        assert unequal is not None
        fitted = unequal.leftover(deformation)
    ones = np.ones_like(rise)
    return np.column_stack([deformation, deformation * rise, ones, rise, fitted])


def _linear_columns(deformation: float, rise: float, time: float) -> np.ndarray:
    # Those of physics.chain.linear_columns.
    return np.array([deformation, deformation * rise, 1.0, rise])
