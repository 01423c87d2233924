"""Scatter of the deformation's gauge, told from an uneven movement by the force."""

import numpy as np
from scipy.stats import norm

# Rows that are averaged into one, to see the slope without the scatter.
_BLOCKS = 12
_FEWEST = 40
# Probability of a false alarm in a record without scatter.
_LEVEL = 1e-4
# The scatter matters when it bends a straight line by more than this share.
_MATTERS = 1e-3
# Least correlation, with the other sign, of second differences with the next ones.
_ALTERNATES = 0.3
# Turning points cannot be seen when ten sd of the scatter are more than this share of
# the range: the largest reversal that noise may hide.
HIDDEN = 0.2


def scatter_of_deformation(x: np.ndarray, y: np.ndarray) -> float:
    """Return the sd of the deformation's reading; 0 where none shows.

    A movement that is really uneven has the force follow it; scatter of the gauge
    does not. Of the second differences the part that the force does not follow is
    the gauge's.

    Args:
        x: deformation, shape (n,).
        y: force, shape (n,).
    """
    if x.size < _FEWEST:
        return 0.0
    slope = _slope(x, y)
    bend_x, bend_y = np.diff(x, 2), np.diff(y, 2)
    if slope == 0.0 or not bend_x.any():
        return 0.0
    # with wild readings and jumps left out
    limit = 8.0 * np.median(np.abs(bend_x)) + 1e-300
    usual = np.abs(bend_x) <= limit
    bend_x, bend_y = bend_x[usual], bend_y[usual]
    parts = bend_x * (bend_x - bend_y / slope) / 6.0
    variance = float(parts.mean())
    # neighbouring second differences share readings: half of them are independent
    error = float(parts.std()) / np.sqrt(parts.size / 2.0)
    clear = variance > norm.isf(_LEVEL) * error
    # of scatter they alternate (-2/3), of a smooth movement they do not
    alternates = np.mean(bend_x[1:] * bend_x[:-1]) < -_ALTERNATES * np.mean(bend_x**2)
    return float(np.sqrt(variance)) if clear and alternates else 0.0


def matters(scatter: float, x: np.ndarray) -> bool:
    """Tell whether scatter makes a straight line too flat.

    Args:
        scatter: sd of the deformation's reading.
        x: deformation, shape (n,).
    """
    return scatter**2 > _MATTERS * float(np.var(x))


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Return the slope between block means, which scatter hardly touches."""
    blocks = [np.array_split(values, _BLOCKS) for values in (x, y)]
    means = [np.array([block.mean() for block in each]) for each in blocks]
    order = np.argsort(means[1])
    low, high = order[: _BLOCKS // 3], order[-(_BLOCKS // 3) :]
    run, rise = (float(m[high].mean() - m[low].mean()) for m in means)
    return rise / run if run else 0.0
