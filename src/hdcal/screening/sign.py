"""Signs of force and deformation, and short runs with nothing to look for."""

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
# From more rows on the scatter of the deformation can be seen, and is looked for.
_MOST_ROWS = 40
# What the residuals of a line with independent noise rarely exceed: the largest one,
# in sd, and the correlation of each with the next one, in its standard errors.
_LARGEST, _CORRELATED = 2.8, 2.0
# Share of the range of the force that is noise at most.
_NOISE = 0.05


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
    if branches and max(branches) < -_CLEAR:
        return "opposite"
    return "unclear" if together * np.sqrt(x.size - 1.0) < -_CHANCE else "same"


def _rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    step = max(1, x.size // 5000)
    if min(np.ptp(x), np.ptp(y)) == 0.0:
        return 0.0
    ranks = np.array([np.argsort(np.argsort(each[::step])) for each in (x, y)])
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def plain_runs(x: np.ndarray, y: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Tell which runs are short, straight and rising, with independent noise.

    Args:
        x: deformation of all runs, shape (n,).
        y: force of all runs, shape (n,).
        run: index of each row's run, shape (n,).

    Returns:
        By index of the run.
    """
    order = np.argsort(run, kind="stable")
    x, y, run = x[order], y[order], run[order]
    rows = np.bincount(run)
    with np.errstate(all="ignore"):
        x = x - (np.bincount(run, x) / rows)[run]
        y = y - (np.bincount(run, y) / rows)[run]
        slope = np.bincount(run, x * y) / np.bincount(run, x * x)
        left = y - slope[run] * x
        squares = np.bincount(run, left * left)
        sd = np.sqrt(squares / rows)
        largest = np.zeros(rows.size)
        np.maximum.at(largest, run, np.abs(left))
        same = np.diff(run) == 0
        pairs = np.bincount(run[1:][same], (left[1:] * left[:-1])[same], rows.size)
        correlation = np.abs(pairs / squares) * np.sqrt(rows)
        noise = sd / np.sqrt(np.bincount(run, y * y) / rows)
    plain = (rows < _MOST_ROWS) & (slope > 0.0) & (noise < _NOISE)
    return plain & (largest <= _LARGEST * sd) & (correlation < _CORRELATED)
