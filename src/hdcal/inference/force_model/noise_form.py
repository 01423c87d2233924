"""Fit of lines by least squares, and a test whether its noise grows."""

from typing import NamedTuple

import numpy as np
from jax import jit
from jaxtyping import Float
from scipy.linalg import orth
from scipy.special import ndtr

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.data.scatter import left_of_lines
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.serial_correlation import previous_rows, whiten
from hdcal.physics.history import stop_cells

# Smallest number of rows for a test of the noise.
_LEAST_ROWS = 12
# Smallest ratio of the noise sds at the ends of the range that counts as growth.
_LEAST_GROWTH = 1.1
# Largest correlation of neighbours that is removed from residuals.
_LARGEST_CORRELATION = 0.95
# Shares of the range after which the cells of a loop slip.
_REACHES = np.array([0.03, 0.06, 0.12, 0.25, 0.5])
# Significance level of the test for noise that grows.
_FALSE_ALARM = 0.05
# Of more specimens or runs the lines or means are subtracted first.
_MOST_COLUMNS = 50
_stop_cells = jit(stop_cells)


class LineFit(NamedTuple):
    """Lines of specimens with zeros of runs, fitted to the force by least squares."""

    # Orthonormal, (n, p).
    columns: np.ndarray
    # Less the means or lines that have no column [N], and the number of these.
    force: np.ndarray
    taken: int

    @property
    def residual(self) -> np.ndarray:
        """Residual force [N]."""
        return self.force - self.columns @ (self.columns.T @ self.force)

    @property
    def noise_sd(self) -> float:
        """Sd of the noise [N]."""
        residual = self.residual
        free = max(len(residual) - self.columns.shape[1] - self.taken, 1)
        return float(np.sqrt(residual @ residual / free))


def fit_lines(records: Records, shapes: str = "line") -> LineFit:
    """Fit a line to each specimen with a zero for each run.

    `shapes` is `line`; `bend` also has a cubic, a step for the direction and a drift
    with the temperature, which stand for effects; `loop` in addition a loop of any
    shape, as of joints that stick and slip, and one that opens with the load.
    """
    run, specimen = np.asarray(records.run), np.asarray(records.specimen)
    force, deformation = (
        np.asarray(values, float) for values in (records.force, records.deformation)
    )
    scaled = deformation / (np.max(np.abs(deformation)) or 1.0)
    centred = (deformation - deformation.mean()) / (np.ptp(deformation) or 1.0)
    rise = np.asarray(records.temperature) - np.mean(records.temperature)
    sense = np.asarray(records.sense, float)
    specimens, runs = np.unique(specimen), np.unique(run)
    columns, taken = [], 0
    if np.ptp(rise) > 0.0:
        # The modulus falls with the temperature; a drift of the zero is no part of it.
        columns += [rise * deformation]
    if shapes != "line":
        columns += [centred**2, centred**3, sense, rise]
    if shapes == "loop":
        loop = [sense * np.abs(scaled), sense * scaled**2]
        columns += [*loop, *loop_cells(records, _REACHES)]
    if len(specimens) > _MOST_COLUMNS:
        *columns, force = (left_of_lines(records, v) for v in (*columns, force))
        taken = len(specimens) + len(runs)
    else:
        # Lines through the origin: several specimens in one run share a zero.
        columns += [scaled * (specimen == i) for i in specimens]
        if len(runs) > _MOST_COLUMNS:
            *columns, force = (less_run_means(v, run) for v in (*columns, force))
            taken = len(runs)
        else:
            columns += [(run == i).astype(float) for i in runs]
    table = np.reshape(columns, (-1, len(force))).T
    return LineFit(orth(table, rcond=1e-10), force, taken)


def pilot_fit(records: Records) -> LineFit:
    """Return a flexible fit, for the size of the noise before any sampling."""
    # Too small a noise only chooses the exact likelihood of rounded readings.
    return fit_lines(records, "bend")


def loop_cells(records: Records, shares: np.ndarray) -> Float[np.ndarray, "c n"]:
    """Return the states of cells that stick and then slip, −1 … 1, row by row.

    A cell slips after its share (c,) of the range of the deformation.
    """
    padded = pad_records(records)
    reach = shares * np.ptp(np.asarray(records.deformation))
    states = _stop_cells(padded.deformation, padded.run, reach)
    return np.asarray(states)[:, : len(records.run)]


def noise_grows(case: Case) -> bool:
    """Return whether readings clearly scatter more the farther the gear is deformed.

    By more than a tenth over the range, which noise in proportion to the deformation
    can do there, with no sd of each row stated and no step of the reading wider than
    the noise. Residuals at the turns of a loop do not count.
    """
    records, pilot = case.records, pilot_fit(case.records)
    coarse = case.gear.force_resolution > pilot.noise_sd
    if len(records.force) < _LEAST_ROWS or coarse or "force_sd" in records.known:
        return False
    far = np.abs(np.asarray(records.deformation))
    if far.max() < _LEAST_GROWTH * far.min():
        return False
    if "unloading" in records.known:
        pilot = fit_lines(records, "loop")
    square = _innovations(pilot.residual, previous_rows(records)) ** 2
    if growth_p_value(square, far) >= _FALSE_ALARM:
        return False
    slope, start = np.polyfit(far, square, 1)
    least, most = start + slope * far.min(), start + slope * far.max()
    return bool(most > _LEAST_GROWTH**2 * least)


def _innovations(residual: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return the innovation of each row, of the same sd in all rows.

    Squares of correlated errors are correlated too, which raises false positives.
    """
    follows, square = before >= 0, float(residual @ residual)
    if not follows.any() or not square > 0.0:
        return residual
    product = float(residual[follows] @ residual[before[follows]]) / follows.sum()
    rho = np.clip(product * len(residual) / square, 0.0, _LARGEST_CORRELATION)
    return whiten(residual, before, float(rho))


def growth_p_value(square, deformation) -> float:
    """Return the p value of Koenker's test for an error variance that grows.

    Errors of constant variance grow so much with the deformation with this probability
    (Koenker, Journal of Econometrics 17, 1981).
    """
    far = np.abs(np.asarray(deformation))
    x, y = far - far.mean(), square - square.mean()
    scale = np.sqrt((x @ x) * (y @ y))
    correlation = float(x @ y) / scale if scale > 0.0 else 0.0
    return float(ndtr(-np.sqrt(len(far)) * correlation))
