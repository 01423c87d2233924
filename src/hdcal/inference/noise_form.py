"""A pilot fit, and whether the noise that it leaves grows with the deformation."""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, ndtr

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.inference.loop_cells import loop_cells
from hdcal.inference.serial_correlation import previous_rows, whiten

# Fewer rows do not show how their noise depends on anything.
_LEAST_ROWS = 12
# Noise sds over a range that differ by less are one: of very many rows any would show.
_LEAST_GROWTH = 1.1
# Degrees of freedom that the noise beside a loop has at least: with fewer all is loop.
_FEWEST_FREE = 4
# Correlation of neighbours that is taken off residuals, at most.
_MOST_ALIKE = 0.95
# Shares of the range after which the cells of a loop slip.
_REACHES = np.array([0.03, 0.06, 0.12, 0.25, 0.5])
# Probability that noise of one size is let grow: one parameter more, near nothing.
_FALSE_ALARM = 0.05


@dataclass(frozen=True)
class Pilot:
    """A fit before any sampling.

    Attributes:
        residual: of each row [N].
        noise_sd: of the noise [N].
        free: degrees of freedom that it has.
    """

    residual: np.ndarray
    noise_sd: float
    free: int


def pilot_fit(records: Records, *, with_loop: bool = False) -> Pilot:
    """Fit records by generous least squares.

    Generous, because too small a noise only chooses the exact rounding likelihood,
    which is never wrong. A cubic in deformation with a slope for each specimen, a step
    for the direction and temperature terms, within runs.

    Args:
        records: the rows.
        with_loop: also fit a loop of any shape, as of joints that stick and slip, and
            one that opens with the load.
    """
    scaled = np.asarray(records.deformation) / np.max(np.abs(records.deformation))
    rise = np.asarray(records.temperature) - np.mean(records.temperature)
    own = [scaled * (records.specimen == i) for i in np.unique(records.specimen)[:50]]
    shapes = [scaled**2, scaled**3, records.sense, rise, rise * scaled]
    if with_loop:
        size = np.abs(scaled)
        shapes += [records.sense * size, records.sense * size**2]
        shapes += [*loop_cells(records, _REACHES)]
    run = np.asarray(records.run)
    *columns, force = (
        less_run_means(np.asarray(values), run)
        for values in (*own, *shapes, records.force)
    )
    design = np.array(columns).T
    beta, _, rank, _ = np.linalg.lstsq(design, force, rcond=None)
    residual = force - design @ beta
    free = max(len(force) - int(np.max(run)) - 1 - int(rank), 1)
    return Pilot(residual, float(np.sqrt(residual @ residual / free)), free)


def noise_grows(case: Case, pilot: Pilot | None = None) -> bool:
    """Return whether readings clearly scatter more the farther the gear is deformed.

    Not by so little that it matters to nobody. Not asked where every row's sd is
    stated, nor below the steps of the reading. What a loop leaves at its turns is no
    noise.

    Args:
        case: records and gear.
        pilot: fit of these records, where there is one.
    """
    records, pilot = case.records, pilot or pilot_fit(case.records)
    coarse = case.gear.force_resolution > pilot.noise_sd
    if len(records.force) < _LEAST_ROWS or coarse or "force_sd" in records.known:
        return False
    if "unloading" in records.known:
        looped = pilot_fit(records, with_loop=True)
        pilot = looped if _is_better(looped, pilot) else pilot
    square = _added(pilot.residual, previous_rows(records)) ** 2
    clear = growth_p_value(square, records.deformation) < _FALSE_ALARM
    return clear and _variance_ratio(square, records.deformation) > _LEAST_GROWTH**2


def _is_better(larger: Pilot, smaller: Pilot) -> bool:
    """Return whether what a larger model adds is seen, by the F test."""
    more = smaller.free - larger.free
    if more <= 0 or larger.free < _FEWEST_FREE:
        return False
    one, two = (p.free * p.noise_sd**2 for p in (smaller, larger))
    ratio = (one - two) / more * larger.free / max(two, 1e-300)
    return float(fdtrc(more, larger.free, ratio)) < _FALSE_ALARM


def _added(residual: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return what each row adds to the row before it, on one scale.

    Where neighbours err alike the squares of their errors come in waves, which pass for
    growth twice or three times as often as those of independent ones.
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
