"""The nearest point at which every limit is kept, by sequential quadratic programming.

The first search leads to where no limit is exceeded (or least exceeded), the second one
to the nearest such point. In logarithms of the sizes both are nearly quadratic with
straight limits, so that a few steps suffice.
"""

from collections.abc import Callable

import numpy as np
import scipy

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

    def kept(point: np.ndarray) -> bool:
        return bool(np.max(excess(point)) <= CLOSE)

    start = np.clip(own, *bounds.T)
    if not kept(start):
        start = _least_excess(excess, slopes, start, bounds)
    if not kept(start):
        return start
    found = _minimise(
        lambda y: (float(np.sum((y - own) ** 2)), 2.0 * (y - own)),
        start,
        bounds,
        lambda y: -excess(y),
        lambda y: -slopes(y),
        1e-14,
    )
    better = np.clip(found, *bounds.T)
    # A solver that failed must not replace a point that keeps the limits.
    return better if kept(better) else start


def _least_excess(excess: Excess, slopes: Excess, start, bounds) -> np.ndarray:
    """Return where the worst excess is least, or none is left: least t ≥ excess."""
    worst = np.append(np.zeros(len(start)), 1.0)
    found = _minimise(
        lambda y: (y[-1], worst),
        np.append(start, float(np.max(excess(start)))),
        [*bounds, (0.0, None)],
        lambda y: y[-1] - excess(y[:-1]),
        lambda y: np.insert(-slopes(y[:-1]), len(start), 1.0, axis=1),
        1e-12,
    )
    return np.clip(found[:-1], *bounds.T)


def _minimise(objective, start, bounds, room, room_slopes, close) -> np.ndarray:
    """Return where an objective with its gradient is least and all room ≥ 0."""
    return scipy.optimize.minimize(
        objective,
        start,
        jac=True,
        bounds=bounds,
        constraints={"type": "ineq", "fun": room, "jac": room_slopes},
        method="SLSQP",
        options={"maxiter": _MOST_STEPS, "ftol": close},
    ).x
