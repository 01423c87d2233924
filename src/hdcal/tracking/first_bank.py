"""The bank before the first row, on a mounting that was not tested."""

import jax.numpy as jnp
import numpy as np
from scipy.special import digamma

from hdcal.inference.serial_correlation import CORRELATION
from hdcal.tracking.bank import CELLS, Bank
from hdcal.tracking.draw_forces import Draws

DRAWS = 128
# Draws per coefficient that a regression needs, and that a model needs.
_PER_COEFFICIENT = 10
# Range of the variance of log σ² within a draw. More of it is between the draws: a
# conjugate prior ties the width of the coefficients to the noise, and a lucky first
# reading would count as a sign of little noise.
_WITHIN = (1e-8, 0.1)
# Pairs of neighbours that the correlation of a calibration counts for.
_PAIRS = 30.0


def first_bank(every: Draws, threshold: float, reopen: float) -> tuple[Draws, Bank]:
    """Return some of the draws, and what they know of a stream.

    Args:
        every: all draws; of several gears, for a new one.
        threshold: of the change alarm [-].
        reopen: share by which the stiffness may have moved at an alarm [-].
    """
    problem, values = every.problem, every.values
    chosen = np.bincount(every.model)[every.model] >= _PER_COEFFICIENT
    chosen = np.flatnonzero(chosen)
    chosen = chosen[np.linspace(0, len(chosen) - 1, DRAWS).astype(int)]
    draws = every.take(chosen)
    mean, covariance = _coefficients(every, chosen)
    mounting, gear = (
        draws.values.get(site, np.zeros(DRAWS)) ** 2 * (1.0 + 1.0 / (tested or np.inf))
        for site, tested in (
            ("run_offset_sd", problem.runs),
            ("specimen_sd", problem.specimens),
        )
    )
    covariance[:, [0, 1], [0, 1]] += np.stack([gear, mounting], axis=1)
    shape, rate = _noise(every, chosen)
    step, rho = float(problem.step), np.mean(values.get(CORRELATION, 0.0))
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
        "remounting": 2.0 * np.mean(values["run_offset_sd"] ** 2),
        "threshold": threshold,
        "reopen": reopen,
    }
    arrays = {name: jnp.asarray(value, float) for name, value in state.items()}
    return draws, Bank(**arrays, epoch=jnp.zeros((), int))


def _coefficients(every: Draws, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    for model in np.unique(every.model[chosen]):
        of, here = every.model == model, every.model[chosen] == model
        about = shapes - shapes[of].mean(axis=0)
        left = target[of] - target[of].mean(axis=0)
        slope, _, rank, _ = np.linalg.lstsq(about[of], left, rcond=1e-10)
        if len(left) < _PER_COEFFICIENT * (size + rank):
            slope, rank = np.zeros_like(slope), 0
        left = left - about[of] @ slope
        mean[here, :size] = target[of].mean(axis=0) + about[chosen[here]] @ slope
        covariance[here, :size, :size] = left.T @ left / (len(left) - 1 - rank)
    # Stiffness relative to that of the draw, zero from that of the draw.
    mean[:, 1] -= values["force_offset"][chosen]
    unit = np.ones_like(mean)
    unit[:, 0] = 1.0 / stiffness[chosen]
    return mean * unit, covariance * unit[:, :, None] * unit[:, None, :]


def _noise(every: Draws, chosen: np.ndarray) -> tuple[float, np.ndarray]:
    """Return shape and rate of the noise variance of each draw [N²]."""
    logs, model = np.log(every.variance), every.model
    centre = (np.bincount(model, logs) / np.maximum(np.bincount(model), 1))[model]
    spread = max(float(np.mean((logs - centre) ** 2)), _WITHIN[0])
    within = min(spread, _WITHIN[1])
    logs = centre + np.sqrt(1.0 - within / spread) * (logs - centre)
    # ψ′(a) = within, to its second order.
    shape = 0.5 * (1.0 + np.sqrt(1.0 + 2.0 * within)) / within
    return shape, np.exp(logs[chosen] + digamma(shape))
