"""The nearest point at which every limit is kept, by sequential quadratic programming.

The first search leads to where no limit is exceeded (or least exceeded), the second one
to the nearest such point. In logarithms of the sizes both are nearly quadratic with
straight limits, so that a few steps suffice.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

# A limit counts as kept when it is exceeded by less than this share of itself.
CLOSE = 1e-6

Excess = Callable[[np.ndarray], np.ndarray]


def nearest_kept(excess: Excess, start: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Return the point inside the bounds nearest to a given one that keeps all limits.

    Args:
        excess: logarithm of each quantity over its limit, (n,) → (m,); at most zero
            where the limit is kept.
        start: the point to stay near, shape (n,).
        bounds: shape (n, 2).

    Returns:
        The point; where no point keeps all limits, the one that exceeds them least.
    """

    def kept(point: np.ndarray) -> bool:
        return bool(np.max(excess(point)) <= CLOSE)

    inside = np.clip(start, *bounds.T)
    if not kept(inside):
        # Least t ≥ excess, at least zero.
        worst = np.append(inside, max(float(np.max(excess(inside))), 0.0))
        ends = [*bounds, (0.0, None)]
        least = _minimise(
            lambda y: y[-1], worst, ends, lambda y: y[-1] - excess(y[:-1])
        )
        inside = np.clip(least[:-1], *bounds.T)
    if not kept(inside):
        return inside
    found = _minimise(
        lambda y: float(np.sum((y - start) ** 2)), inside, bounds, lambda y: -excess(y)
    )
    better = np.clip(found, *bounds.T)
    # A solver that failed must not replace a point that keeps the limits.
    return better if kept(better) else inside


def _minimise(objective, start, bounds, room) -> np.ndarray:
    """Return where an objective is least and all room ≥ 0."""
    limits = {"type": "ineq", "fun": room}
    options = {"maxiter": 200, "ftol": 1e-14}
    return minimize(
        objective,
        start,
        bounds=bounds,
        constraints=limits,
        method="SLSQP",
        options=options,
    ).x
