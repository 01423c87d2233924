"""Sign conventions of force and deformation."""

from itertools import pairwise
from typing import Literal

import numpy as np

from hdcal.screening.turning_points import turning_points

Sign = Literal["same", "opposite", "unclear", "unknown"]
# A movement over this share of the range is a branch of the curve.
_BRANCH = 0.2
# Rank correlation from which on force and deformation surely go together, and the
# standard errors beyond which it is no chance.
_CLEAR = 0.9
_CHANCE = 3.5


def sign_of_slope(x: np.ndarray, y: np.ndarray, scatter: float = 0.0) -> Sign:
    """Tell whether force and deformation grow together.

    Opposite: the force falls with the deformation all along every branch, loading and
    unloading, as it does when one channel is counted the other way. Unclear: it falls
    in the mean, but not so.
    """
    together = _rank_correlation(x, y)
    if together >= 0.0:
        return "same"
    turns, _ = turning_points(x, max(_BRANCH * float(np.ptp(x)), 10.0 * scatter))
    ends = [0, *turns.tolist(), x.size - 1]
    branches = [
        _rank_correlation(x[first : last + 1], y[first : last + 1])
        for first, last in pairwise(ends)
        if last - first >= 4
    ]
    opposite = bool(branches) and max(branches) < -_CLEAR
    if opposite:
        return "opposite"
    return "unclear" if together * np.sqrt(x.size - 1.0) < -_CHANCE else "same"


def _rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    step = max(1, x.size // 5000)
    if min(np.ptp(x), np.ptp(y)) == 0.0:
        return 0.0
    ranks = np.array([np.argsort(np.argsort(each[::step])) for each in (x, y)])
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])
