"""Short runs that a straight line explains, so that there is nothing to look for."""

import numpy as np

# From more rows on the scatter of the deformation can be seen, and is looked for.
_MOST_ROWS = 40
# What the residuals of a line with independent noise rarely exceed: the largest one,
# in sd, and the correlation of each with the next one, in its standard errors.
_LARGEST, _CORRELATED = 2.8, 2.0
# Share of the range of the force that is noise at most.
_NOISE = 0.05


def plain_runs(x: np.ndarray, y: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Tell which runs are short, straight and rising, with independent noise.

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
