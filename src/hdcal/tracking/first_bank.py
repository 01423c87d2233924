"""The bank before the first row, on a mounting that was not tested."""

import jax.numpy as jnp
import numpy as np
from scipy.special import digamma

from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.tracking.bank import CELLS, Bank
from hdcal.tracking.draw_forces import MOUNTING, StreamDraws

DRAWS = 128
# Draws per coefficient that a regression needs, and fewest draws of a model.
_PER_COEFFICIENT = 10
# Largest variance of log σ² within a draw: a conjugate prior ties the width of the
# coefficients to the noise, and a lucky first reading would say that there is little.
_MOST_WITHIN = 0.1
# Pairs of neighbours that the correlation of a calibration counts for.
_PAIRS = 30.0


def first_bank(every: StreamDraws, threshold: float) -> tuple[StreamDraws, Bank]:
    """Return some of the draws, and what they know of a stream."""
    number, problem = every.model.number, every.model.problem
    rows = np.flatnonzero(np.bincount(number)[number] >= _PER_COEFFICIENT)
    rows = rows[np.linspace(0, len(rows) - 1, DRAWS).astype(int)]
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
        "log_weight": np.full(DRAWS, -np.log(DRAWS)),
        "columns": np.zeros_like(mean),
        "reading": np.zeros(DRAWS),
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
    mean = np.zeros((DRAWS, size + 2))
    covariance = np.tile(np.eye(size + 2), (DRAWS, 1, 1))
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
