"""The nearest point at which every limit is kept: two small programs with slopes.

Sequential quadratic programming, first to where nothing is exceeded (or least), then
to the nearest such point. In logarithms of the sizes both are nearly quadratic with
straight limits, so that a few steps do.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

# A limit counts as kept when it is exceeded by less than this share of itself.
CLOSE = 1e-6
_MOST_STEPS = 200

Excess = Callable[[np.ndarray], np.ndarray]


def nearest_kept(
    excess: Excess, slopes: Excess, own: np.ndarray, bounds: np.ndarray
) -> np.ndarray:
    """Return the point inside the bounds nearest to a given one that keeps all limits.

    Args:
        excess: logarithm of each quantity over its limit, (n,) → (m,); at most zero
            where the limit is kept.
        slopes: its Jacobian, (n,) → (m, n).
        own: the point to stay near, shape (n,).
        bounds: shape (n, 2).

    Returns:
        The point; where no point keeps all limits, the one that exceeds them least.
    """
    z = np.clip(own, *bounds.T)
    if not _kept(excess(z)):
        z = _least_excess(excess, slopes, z, bounds)
    return _nearest(excess, slopes, z, own, bounds) if _kept(excess(z)) else z


def _kept(excess: np.ndarray) -> bool:
    return bool(np.max(excess) <= CLOSE)


def _least_excess(excess: Excess, slopes: Excess, z, bounds) -> np.ndarray:
    """Return where the worst excess is least, or none is left: least t ≥ excess."""
    worst = np.append(np.zeros(len(z)), 1.0)
    done = minimize(
        lambda y: y[-1],
        np.append(z, float(np.max(excess(z)))),
        jac=lambda y: worst,
        bounds=[*bounds, (0.0, None)],
        constraints={
            "type": "ineq",
            "fun": lambda y: y[-1] - excess(y[:-1]),
            "jac": lambda y: np.insert(-slopes(y[:-1]), len(z), 1.0, axis=1),
        },
        method="SLSQP",
        options={"maxiter": _MOST_STEPS, "ftol": 1e-12},
    )
    return np.clip(done.x[:-1], *bounds.T)


def _nearest(excess: Excess, slopes: Excess, z, own, bounds) -> np.ndarray:
    done = minimize(
        lambda y: float(np.sum((y - own) ** 2)),
        z,
        jac=lambda y: 2.0 * (y - own),
        bounds=bounds,
        constraints={
            "type": "ineq",
            "fun": lambda y: -excess(y),
            "jac": lambda y: -slopes(y),
        },
        method="SLSQP",
        options={"maxiter": _MOST_STEPS, "ftol": 1e-14},
    )
    better = np.clip(done.x, *bounds.T)
    # A solver that lost its way may not cost what was already found.
    return better if _kept(excess(better)) else z
