"""A clock that wraps, is reset or goes backwards."""

import numpy as np

# More steps back than this are no resets but rows that are out of order.
_MOST = 3


def steps_back(time: np.ndarray) -> np.ndarray:
    """Return the rows at which time is before that of the row before.

    Args:
        time: as read [s], shape (n,).
    """
    return np.flatnonzero(np.diff(time) < 0.0) + 1


def out_of_order(rows: np.ndarray) -> bool:
    """Tell whether so many steps back are no resets.

    Args:
        rows: of `steps_back`.
    """
    return rows.size > _MOST


def counted_on(time: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the time counted on at each reset, by the usual step.

    Args:
        time: as read [s], shape (n,).
        rows: of `steps_back`.
    """
    steps = np.diff(time)
    usual = float(np.median(steps[steps >= 0.0])) if np.any(steps >= 0.0) else 0.0
    steps[rows - 1] = usual
    return time[0] + np.r_[0.0, np.cumsum(steps)]
