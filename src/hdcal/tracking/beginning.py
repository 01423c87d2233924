"""What a tracker begins with: its prior, its core, and rows such as will come."""

from collections.abc import Callable

import numpy as np

from hdcal.data.case import Gear
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.tracking.effect_tracking import build_particles, force_effects
from hdcal.tracking.first_rows import FirstRows
from hdcal.tracking.linear_core import LinearCore
from hdcal.tracking.normal_inverse_gamma import match_draws
from hdcal.tracking.particles import Particles
from hdcal.tracking.stream_prior import (
    StreamPrior,
    prior_from_gear,
    prior_from_posterior,
)


def begin_prior(known: Posterior | Gear, seed: int) -> StreamPrior:
    """Return what is known before the first row.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: it holds what cannot be followed row by row.
    """
    if isinstance(known, Gear):
        return prior_from_gear(known, seed)
    known.require_usable()
    if known.problem.discrepancy is not None:
        words = "holds a leftover discrepancy, which cannot be followed"
        raise InputError([Finding("known", words, "Calibrate again without it")])
    return prior_from_posterior(known, seed)


def begin_core(
    known: Posterior | Gear, prior: StreamPrior, forget: float
) -> tuple[LinearCore | FirstRows | Particles, Callable[..., np.ndarray]]:
    """Return the core, and what makes of a row the columns that it takes."""
    if isinstance(known, Gear):
        return FirstRows(prior.coefficients(), prior.variance), _linear_columns
    if force_effects(known):
        return build_particles(known, prior, forget)
    law = match_draws(prior.coefficients(), prior.variance)
    return LinearCore(law, forget), _linear_columns


def usual_design(known: Posterior | Gear, prior: StreamPrior) -> np.ndarray:
    """Return linear columns of rows such as will come, shape (row, 4)."""
    if isinstance(known, Gear):
        # The scale of deformations matters little.
        deformation = np.linspace(0.0, known.full_scale.deformation, 50)
        rise = np.zeros(50)
    else:
        deformation = np.asarray(known.case.records.deformation)
        rise = np.asarray(known.case.records.temperature)
        rise = rise - prior.reading.reference_temperature
    ones = np.ones_like(rise)
    return np.stack([deformation, deformation * rise, ones, rise], axis=1)


def _linear_columns(deformation: float, rise: float, time: float) -> np.ndarray:
    # Those of physics.chain.linear_columns.
    return np.array([deformation, deformation * rise, 1.0, rise])
