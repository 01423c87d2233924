"""How heavy the tail of importance weights is: whether few of them carry a sum.

Source: Vehtari, Simpson, Gelman, Yao and Gabry, Pareto smoothed importance sampling,
Journal of Machine Learning Research 25 (2024); the fit is that of Zhang and Stephens,
Technometrics 51, 316 (2009).
"""

import numpy as np
from scipy.special import softmax

# The tail: three roots of the weights, or a fifth of few of them.
_ROOTS, _SHARE, _FEW, _FEWEST = 3.0, 5, 225, 5
# Grid of the fit, and what is believed of the shape as so many weights count.
_GRID, _PRIOR_WEIGHTS, _PRIOR_SHAPE, _PRIOR_SCALE = 30, 10, 0.5, 3.0
_NEGLIGIBLE = 10.0 * np.finfo(float).eps


def pareto_shape(weight: np.ndarray) -> float:
    """Return the shape of the generalised Pareto law of the largest weights.

    It is infinite where hardly any draw has a weight.

    Args:
        weight: of independent draws, up to a factor, shape (n,).

    Raises:
        ValueError: the largest weights are all the same, or there are hardly any.
    """
    ordered, many = np.sort(weight), len(weight)
    size = int(_ROOTS * np.sqrt(many)) if many > _FEW else many // _SHARE
    if size < _FEWEST or size >= many:
        raise ValueError(f"{many} weights have no tail")
    if not ordered[-size - 1] > 0.0:
        return np.inf
    beyond = ordered[-size:] - ordered[-size - 1]
    if not beyond[-1] - beyond[0] > np.finfo(float).tiny:
        raise ValueError("the largest weights are all the same")
    return _shape(beyond)


def _shape(beyond: np.ndarray) -> float:
    """Return the shape for what lies beyond a threshold, ascending, shape (n,)."""
    many = len(beyond)
    points = _GRID + int(np.sqrt(many))
    quartile = beyond[int(many / 4 + 0.5) - 1]
    scale = 1.0 - np.sqrt(points / (np.arange(1.0, points + 1.0) - 0.5))
    scale = scale / (_PRIOR_SCALE * quartile) + 1.0 / beyond[-1]
    shape = np.log1p(-scale[:, None] * beyond).mean(axis=1)
    chance = softmax(many * (np.log(-scale / shape) - shape - 1.0))
    chance = np.where(chance >= _NEGLIGIBLE, chance, 0.0)
    likely = np.average(scale, weights=chance)
    fitted = np.log1p(-likely * beyond).mean()
    believed = _PRIOR_WEIGHTS * _PRIOR_SHAPE
    return float((many * fitted + believed) / (many + _PRIOR_WEIGHTS))
