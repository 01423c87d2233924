"""Bands of the calibrated model around the record that it was calibrated with."""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import jax
import numpy as np

from hdcal.exported import jit
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.dynamic_problem import DynamicProblem, predict_states, stretch
from hdcal.report.intervals import INTERVAL

# Draws from which the bands of a record are made.
_DRAWS = 1000
# Longer records are taken in stretches of so many rows, to bound the memory.
_STRETCH = 1024


@dataclass(frozen=True)
class MotionBands:
    """A calibrated record with equal-tailed 95 % bands; one entry per row.

    Attributes:
        time_s: since the first row.
        force_N: as read: the input.
        deformation_mm: as read: the output.
        mean_lo_mm: credible band of the mean reading.
        mean_median_mm: its median.
        mean_hi_mm: its upper end.
        new_measurement_lo_mm: predictive band of one more reading.
        new_measurement_hi_mm: its upper end.
        usable: the calibration passed its checks.
    """

    time_s: np.ndarray
    force_N: np.ndarray
    deformation_mm: np.ndarray
    mean_lo_mm: np.ndarray
    mean_median_mm: np.ndarray
    mean_hi_mm: np.ndarray
    new_measurement_lo_mm: np.ndarray
    new_measurement_hi_mm: np.ndarray
    usable: np.ndarray

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns in the order of motion.csv."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


@jit
def _predict(problem: DynamicProblem, values, seed):
    keys = jax.random.split(jax.random.key(seed), len(values["mass"]))

    def one(value, key):
        states = predict_states(problem, value)
        mean = states[:, 0] + value["deformation_offset"]
        # The same quantile in every row: bands are row by row, and smooth so.
        new = mean + value["deformation_sigma"] * jax.random.normal(key)
        return mean, new, states[-1]

    return jax.vmap(one)(values, keys)


def _stretches(problem: DynamicProblem, values, seed) -> Iterator[np.ndarray]:
    """Yield the bands of one stretch of rows after the other, shape (6, row).

    Each stretch begins with the last row of the one before, where its states are known.
    """
    tails = np.array([0.5 - INTERVAL / 2.0, 0.5, 0.5 + INTERVAL / 2.0])
    for first in range(0, problem.count, _STRETCH):
        part = stretch(problem, first, _STRETCH + 1)
        mean, new, last = map(np.asarray, _predict(part, values, seed))
        values = values | {
            "initial_deformation": last[:, 0],
            "initial_velocity": last[:, 1],
        }
        kept = slice(min(part.count, _STRETCH))
        both = mean[:, kept], new[:, kept]
        yield np.concatenate([np.quantile(each, tails, axis=0) for each in both])


def motion_bands(posterior: DynamicPosterior, seed: int = 0) -> MotionBands:
    """Return the record that was calibrated with the bands of the model around it.

    Args:
        posterior: from `calibrate_dynamic`.
        seed: of the new readings' noise.
    """
    problem, draws = posterior.moving, posterior.draws
    rows = np.linspace(0, len(draws["mass"]) - 1, _DRAWS).astype(int)
    values = {name: draw[rows] for name, draw in draws.items()}
    real = slice(problem.count)
    parts = list(_stretches(problem, values, seed))
    low, middle, high, new_low, _, new_high = np.concatenate(parts, axis=1)
    return MotionBands(
        np.asarray(problem.time[real]),
        np.asarray(problem.force[real]),
        np.asarray(problem.deformation[real]),
        low,
        middle,
        high,
        new_low,
        new_high,
        np.full(problem.count, posterior.usable),
    )
