"""Readings whose displacement gauge scatters, moved along their line.

Scatter in the deformation makes a fitted slope too small by the share that it has in
the variance of the deformation (regression dilution). Where the force follows the
deformation smoothed over the rows more closely than the readings, the gauge scatters
and not the part. The smoothed deformation is then an instrument (two-stage least
squares): each reading moves parallel to the line to its smoothed deformation, which
keeps its distance from the line, so that the interval of the slope counts the scatter.
"""

import numpy as np
from scipy.interpolate import make_smoothing_spline

# A smaller share of the variance makes a slope too small by a thousandth at most.
_LEAST_SHARE = 1e-3
# Positive evidence for the smoothed deformation, 3 : 1.
_LOG_POSITIVE = np.log(3.0)
# Fewer rows do not show a scatter.
_LEAST_ROWS = 20


def without_scatter(
    deformation: np.ndarray, force: np.ndarray, run: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return readings without scatter in the deformation, and that scatter.

    Args:
        deformation: in the order it was taken [mm], shape (n,).
        force: as read [N], shape (n,).
        run: index of the mounting, shape (n,).

    Returns:
        Deformation [mm] and force [N], as given where no scatter shows, and the sd of
        the scatter that was removed [mm], 0 where none was.
    """
    smooth, steps = np.array(deformation, float), []
    for label in np.unique(run):
        rows = np.flatnonzero(run == label)
        if len(rows) < _LEAST_ROWS or _share(deformation[rows]) < _LEAST_SHARE:
            return deformation, force, 0.0
        order = np.arange(len(rows), dtype=float)
        smooth[rows] = make_smoothing_spline(order, deformation[rows])(order)
        moved = deformation[rows], smooth[rows], force[rows]
        steps.append([np.diff(values) for values in moved])
    read, steady, forces = (np.concatenate(part) for part in zip(*steps, strict=True))
    # Differences of neighbours, so that neither bends nor loops have a part in it.
    slope = float(
        np.polyfit(smooth - _means(smooth, run), force - _means(force, run), 1)[0]
    )
    left = [np.sum((forces - slope * step) ** 2) for step in (read, steady)]
    if (
        not left[0] > 0.0
        or 0.5 * len(forces) * np.log(left[0] / left[1]) < _LOG_POSITIVE
    ):
        return deformation, force, 0.0
    moved = smooth - deformation
    return smooth, force + slope * moved, float(np.std(moved))


def _share(deformation: np.ndarray) -> float:
    """Return the share of scatter in the variance, from second differences."""
    variance = float(np.var(deformation))
    # The sd of x[i-1] − 2 x[i] + x[i+1] is √6 times that of independent x.
    return float(np.mean(np.diff(deformation, 2) ** 2)) / 6.0 / (variance or np.inf)


def _means(values: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Return the mean of the run of each row."""
    return (np.bincount(run, values) / np.bincount(run))[run]
