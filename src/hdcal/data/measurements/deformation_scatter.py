"""Readings whose displacement gauge scatters, moved along their line.

Scatter in the deformation makes a fitted slope too small by the share that it has in
the variance of the deformation (regression dilution). The deformation smoothed over the
rows is an instrument (two-stage least squares): each reading moves parallel to the line
to its smoothed deformation. Its distance from the line stays, so that the interval of
the slope counts the scatter.
"""

import numpy as np
from scipy.interpolate import make_smoothing_spline

from hdcal.data.records import less_run_means

# Of fewer rows SciPy makes no spline.
_LEAST_ROWS = 5


def without_scatter(
    deformation: np.ndarray, force: np.ndarray, run: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return deformation [mm] and force [N] without scatter in the deformation, (n,).

    The smoothness is chosen by generalised cross-validation, for each run.
    """
    smooth = np.array(deformation, float)
    for label in np.unique(run):
        rows = np.flatnonzero(run == label)
        if len(rows) >= _LEAST_ROWS:
            order = np.arange(len(rows), dtype=float)
            smooth[rows] = make_smoothing_spline(order, deformation[rows])(order)
    place, height = (less_run_means(values, run) for values in (smooth, force))
    slope = float(place @ height) / float(place @ place)
    return smooth, force + slope * (smooth - deformation)
