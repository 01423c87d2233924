"""The stiffness beside a loop of any shape, where the model has a straight line alone.

y = zero of its run + s x + Σ w_j z_j + e: cells z_j that stick and slip after various
shares of the range, and a loop that opens with the load. Their sizes w_j ~ N(0, τ²)
are of any sign and any spread; neighbours may err alike, ρ. Flat priors of zeros, s,
log σ, log τ and ρ: all but τ/σ and ρ are integrated exactly, these by a grid.
"""

import numpy as np
import scipy
from scipy.special import stdtr

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.evidence.prepare import moments
from hdcal.inference.loop_cells import loop_cells
from hdcal.inference.serial_correlation import log_volume, previous_rows, whiten

# Shares of the range after which cells slip.
_REACHES = np.array([0.02, 0.05, 0.1, 0.2, 0.4, 0.8])
# Sizes of the loop in noise sds, and correlations of neighbours.
_SIZES = np.geomspace(0.1, 1000.0, 25)
_CORRELATIONS = np.array([0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97])
# More readings, or runs of them, take more time than an aside is worth.
_MOST_ROWS, _MOST_RUNS = 20_000, 50
# Degrees of freedom that the noise has at least.
_FEWEST_FREE = 10


def loop_stiffness(case: Case, levels: np.ndarray) -> np.ndarray | None:
    """Return posterior quantiles of the stiffness beside a loop [N/mm as read].

    Source of the prior of sizes: MacKay, Neural Computation 4 (1992), evidence for a
    common scale of coefficients.

    Args:
        case: of one specimen, loaded and unloaded.
        levels: probabilities of the quantiles, shape (q,).

    Returns:
        Quantiles, shape (q,); None where rows are too many or too few, of several
        specimens, or each have an sd of their own, and where gauges have gains.
    """
    records = case.records
    rows, runs = len(records.force), len(np.unique(records.run))
    free = rows - runs - 1
    if rows > _MOST_ROWS or runs > _MOST_RUNS or free < _FEWEST_FREE + len(_REACHES):
        return None
    if len(case.specimen_labels) > 1 or "force_sd" in records.known:
        return None
    # Gains that certificates state are taken off a calibration's stiffness, not here.
    if case.gear.gauge_priors:
        return None
    if "unloading" not in records.known:
        return None
    loss, loss_sd = moments(case.gear.priors["alpha"])
    warm = np.asarray(records.temperature) - case.gear.reference_temperature
    x = np.asarray(records.deformation) * (1.0 - loss * warm)
    zeros = np.asarray(records.run)[:, None] == np.unique(records.run)
    line = np.column_stack([x, zeros])
    parts = _parts(records, line, _loops(records), free)
    density, centre, scale = parts.T
    weight = np.exp(density - density.max())
    # What is not known of the modulus at the temperatures of the test.
    mixture = weight, centre, np.hypot(scale, centre * loss_sd * np.mean(warm)), free
    return np.array([_quantile(level, *mixture) for level in levels])


def _loops(records: Records) -> np.ndarray:
    """Return columns of loops, of unit size each, shape (n, j)."""
    far = np.abs(np.asarray(records.deformation))
    opening = np.asarray(records.sense) * far / far.max()
    return np.column_stack([*loop_cells(records, _REACHES), opening])


def _parts(records: Records, line, loops, free: int) -> np.ndarray:
    """Return log density, mean and scale of the stiffness at each place of the grid."""
    before, force = previous_rows(records), np.asarray(records.force)
    table = np.column_stack([line, loops, force])
    found = []
    # Flat in the correlation, whose places are not evenly apart.
    widths = np.gradient(_CORRELATIONS)
    for correlation, width in zip(_CORRELATIONS, widths, strict=True):
        own = whiten(table, before, correlation)
        volume = float(log_volume(np.sum(before >= 0), correlation))
        products = own.T @ own
        for size in _SIZES:
            part = _part(products, line.shape[1], size, free)
            found.append((part[0] - volume + np.log(width), *part[1:]))
    return np.array(found)


def _part(products: np.ndarray, fixed: int, size: float, free: int):
    """Return log density, mean and scale given τ/σ, from sums of whitened columns."""
    precision = products[:-1, :-1].copy()
    loop = np.arange(fixed, len(precision))
    precision[loop, loop] += size**-2
    inverse = np.linalg.inv(precision)
    centre = inverse @ products[:-1, -1]
    square = max(float(products[-1, -1] - products[:-1, -1] @ centre), 1e-300)
    log_det = np.linalg.slogdet(precision)[1] + 2.0 * len(loop) * np.log(size)
    density = -0.5 * (log_det + free * np.log(square))
    return density, centre[0], np.sqrt(square / free * inverse[0, 0])


def _quantile(level: float, weight, mean, scale, free: int) -> float:
    """Return a quantile of a mixture of Student-t distributions."""

    def excess(value: float) -> float:
        below = stdtr(free, (value - mean) / scale)
        return float(np.average(below, weights=weight)) - level

    ends = mean.min() - 50.0 * scale.max(), mean.max() + 50.0 * scale.max()
    return scipy.optimize.root_scalar(excess, bracket=ends).root
