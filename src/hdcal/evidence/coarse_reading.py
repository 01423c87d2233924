"""Coarse readings: whether all forces lie on a grid coarser than their digits."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from hdcal.data.case import Case
from hdcal.inference.noise_form import pilot_fit

# A grid matters from one noise sd on: below, rounding adds less than a tenth to the
# variance. Rounding to a step scatters by step/√12: much wider than the noise, forces
# were set and not read.
_LEAST, _MOST = 1.0, 1.5 * np.sqrt(12.0)
# Forces lie on a grid where none is farther from it than this share of its step.
_OFF = 0.05
# Fits of the grid, and growth of the range of each.
_FITS, _GROWTH = 8, 8.0


def with_coarse_step(case: Case) -> Case:
    """Return the case with the step of its force reading in its gear, if it is coarse.

    That readings are coarse is a fact of the record. As a hypothesis it would compete
    with those on the mean reading, and explains none of it.
    """
    if case.gear.force_resolution > 0.0:
        return case
    noise_sd = pilot_fit(case.records).noise_sd
    step = _grid_step(np.asarray(case.records.force, float), noise_sd)
    if not _LEAST * noise_sd <= step <= _MOST * noise_sd:
        return case
    return replace(case, gear=replace(case.gear, force_resolution=step))


def coarse_step(case: Case, noise_sd: float) -> float:
    """Return the step of the force reading where it matters [N], else 0.

    Args:
        case: whose gear states the step.
        noise_sd: of a reading [N].
    """
    step = case.gear.force_resolution
    return step if step >= _LEAST * noise_sd else 0.0


def _grid_step(force: Float[np.ndarray, " n"], noise_sd: float) -> float:
    """Return the step of the grid on which all forces lie, 0 without one."""
    values = np.unique(force)
    gaps = np.diff(values)
    gaps = gaps[gaps > _OFF * noise_sd]
    if len(gaps) < 2:
        return 0.0
    step, zero = float(gaps.min()), 0.0
    # A step that is a little wrong miscounts far values: near ones improve it first.
    for reach in _GROWTH ** np.arange(1, _FITS + 1):
        near = values[values <= values[0] + reach * step]
        counts = np.round((near - values[0]) / step)
        if counts[-1] >= 2.0 and len(near) > 2:
            step, zero = map(float, np.polyfit(counts, near, 1))
    off = np.abs(values - zero - step * np.round((values - zero) / step))
    return step if off.max() <= _OFF * step else 0.0
