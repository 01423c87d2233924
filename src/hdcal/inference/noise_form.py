"""A pilot fit, and whether the noise that it leaves grows with the deformation."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.data.scatter import left_of_lines
from hdcal.exported import jit
from hdcal.inference.padding import pad_records
from hdcal.inference.serial_correlation import previous_rows, whiten
from hdcal.physics.history import stop_cells

# Fewer rows do not show how their noise depends on anything.
_LEAST_ROWS = 12
# Noise sds over a range that differ by less count as one.
_LEAST_GROWTH = 1.1
# Correlation of neighbours that is taken off residuals, at most.
_MOST_ALIKE = 0.95
# Shares of the range after which the cells of a loop slip.
_REACHES = np.array([0.03, 0.06, 0.12, 0.25, 0.5])
# Probability that growth is found in noise of one size.
_FALSE_ALARM = 0.05
# Slopes of so many specimens have columns; of more each one's line is taken off first.
MOST_SPECIMENS = 50
_stop_cells = jit(stop_cells)


@dataclass(frozen=True)
class Pilot:
    """A fit before any sampling.

    Attributes:
        residual: of each row [N].
        noise_sd: of the noise [N].
    """

    residual: np.ndarray
    noise_sd: float


def pilot_fit(records: Records, *, with_loop: bool = False) -> Pilot:
    """Fit records by generous least squares within runs.

    Generous, because too small a noise only chooses the exact rounding likelihood,
    which is never wrong: a cubic in deformation with a slope for each specimen, a step
    for the direction and temperature terms.

    Args:
        records: the rows.
        with_loop: also fit a loop of any shape, as of joints that stick and slip, and
            one that opens with the load.
    """
    scaled = np.asarray(records.deformation) / np.max(np.abs(records.deformation))
    rise = np.asarray(records.temperature) - np.mean(records.temperature)
    specimens = np.unique(records.specimen)
    many = len(specimens) > MOST_SPECIMENS
    own = [] if many else [scaled * (records.specimen == i) for i in specimens]
    shapes = [scaled**2, scaled**3, records.sense, rise, rise * scaled]
    if with_loop:
        size = np.abs(scaled)
        shapes += [records.sense * size, records.sense * size**2]
        shapes += [*loop_cells(records, _REACHES)]
    run = np.asarray(records.run)
    *columns, force = (
        left_of_lines(records, np.asarray(values))
        if many
        else less_run_means(np.asarray(values), run)
        for values in (*own, *shapes, records.force)
    )
    design = np.array(columns).T
    beta, _, rank, _ = np.linalg.lstsq(design, force, rcond=None)
    residual = force - design @ beta
    lines = len(specimens) if many else 0
    free = max(len(force) - int(np.max(run)) - 1 - lines - int(rank), 1)
    return Pilot(residual, float(np.sqrt(residual @ residual / free)))


def loop_cells(records: Records, shares: np.ndarray) -> Float[np.ndarray, "c n"]:
    """Return the states of cells that stick and then slip, −1 … 1, row by row.

    Args:
        records: the rows.
        shares: of the range of the deformation, after which a cell slips, shape (c,).
    """
    padded = pad_records(records)
    reach = shares * np.ptp(np.asarray(records.deformation))
    states = _stop_cells(padded.deformation, padded.run, reach)
    return np.asarray(states)[:, : len(records.run)]


def noise_grows(case: Case, pilot: Pilot | None = None) -> bool:
    """Return whether readings clearly scatter more the farther the gear is deformed.

    By more than a tenth over the range, which noise in proportion to the deformation
    can do there, with no sd of each row stated and no step of the reading wider than
    the noise. What a loop leaves at its turns is no noise.

    Args:
        case: records and gear.
        pilot: fit of these records, where there is one.
    """
    records, pilot = case.records, pilot or pilot_fit(case.records)
    coarse = case.gear.force_resolution > pilot.noise_sd
    if len(records.force) < _LEAST_ROWS or coarse or "force_sd" in records.known:
        return False
    far = np.abs(np.asarray(records.deformation))
    if far.max() < _LEAST_GROWTH * far.min():
        return False
    if "unloading" in records.known:
        pilot = pilot_fit(records, with_loop=True)
    square = _added(pilot.residual, previous_rows(records)) ** 2
    clear = growth_p_value(square, records.deformation) < _FALSE_ALARM
    return clear and _variance_ratio(square, records.deformation) > _LEAST_GROWTH**2


def _added(residual: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return what each row adds to the row before it, on one scale.

    Squares of correlated errors come in waves, which pass for growth too often.
    """
    follows, square = before >= 0, float(residual @ residual)
    if not follows.any() or not square > 0.0:
        return residual
    tied = float(residual[follows] @ residual[before[follows]]) / follows.sum()
    rho = np.clip(tied * len(residual) / square, 0.0, _MOST_ALIKE)
    return whiten(residual, before, float(rho))


def _variance_ratio(square: np.ndarray, deformation) -> float:
    """Return the variance at the farthest row over that at the nearest, on a line."""
    far = np.abs(np.asarray(deformation))
    slope, start = np.polyfit(far, square, 1)
    least, most = start + slope * far.min(), start + slope * far.max()
    return float(most / least) if least > 0.0 else np.inf


def growth_p_value(square, deformation) -> float:
    """Return how rarely squared errors of one size grow so much with deformation.

    The test is that of Koenker, Journal of Econometrics 17 (1981).

    Args:
        square: of each row's error, shape (n,).
        deformation: as read [mm], shape (n,).
    """
    far = np.abs(np.asarray(deformation))
    off, left = far - far.mean(), square - square.mean()
    scale = np.sqrt((off @ off) * (left @ left))
    tied = float(off @ left) / scale if scale > 0.0 else 0.0
    return float(ndtr(-np.sqrt(len(far)) * tied))
