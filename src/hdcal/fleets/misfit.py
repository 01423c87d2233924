"""What straight lines leave over, in all gears together: a bend, a loop, neighbours."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.loading import loading_side
from hdcal.data.records import Records
from hdcal.data.scatter import left_of_lines
from hdcal.inference.serial_correlation import previous_rows
from hdcal.report.answer import Real

# Standard errors from which on something is said: of three tests in no fleet by chance.
CLEAR = 4.0
# What is smaller is not worth saying: in noise sds, and as a correlation.
_SMALL, _LITTLE = 0.2, 0.2
# Correlation that is believed at most.
_MOST_ALIKE = 0.99
# Share of a shape that is not in those before it, from which on it is one of its own.
_OTHER = 0.05
# Size of a shape, of sizes about one, that rounding alone gives.
_NOTHING = 1e-9


@dataclass(frozen=True)
class Misfit:
    """What the readings of a fleet have beside their straight lines.

    Attributes:
        correlation: of neighbouring errors; 0 where none is seen [-].
        loop_N: of loading above unloading, in the mean; 0 where none is seen [N].
        bend_N: of the middle of a curve under its ends, likewise [N].
    """

    correlation: Real
    loop_N: Real
    bend_N: Real

    @property
    def widening(self) -> float:
        """Factor by which intervals of a gear are too narrow for it, about."""
        return float(np.sqrt((1.0 + self.correlation) / (1.0 - self.correlation)))


def misfit(case: Case, noise_sd: np.ndarray, own: np.ndarray) -> Misfit:
    """Return what readings have beside straight lines with a zero for each mounting.

    Args:
        case: the readings.
        noise_sd: of each gear beside its own shapes, shape (g,) [N].
        own: sizes of a loop and a bend that are clearly a gear's own, NaN elsewhere,
            shape (2, g) [N]: neighbours do not err alike for these.
    """
    records = case.records
    if not len(records.force):
        return Misfit(0.0, 0.0, 0.0)
    gear, sd = np.asarray(records.specimen), noise_sd[records.specimen]
    error, shapes = beside_lines(records)
    sizes, clear = _fitted(shapes.T, error, sd)
    left = error - np.sum(np.nan_to_num(own)[:, gear] * shapes, axis=0)
    # What the other gears have in common is nobody's own.
    common = shapes * np.isnan(own)[:, gear]
    left -= _fitted(common.T, left, sd)[0] @ common
    correlation = _correlation(left / sd, previous_rows(records))
    scatter = Misfit(correlation, 0.0, 0.0).widening
    seen = np.abs(clear) > np.maximum(CLEAR * scatter, _SMALL * np.sqrt(len(error)))
    loop, bend = np.where(seen, sizes, 0.0)
    swing = float(np.nanmedian(swings(shapes[1], gear)))
    return Misfit(correlation, 2.0 * float(loop), swing * float(bend))


def beside_lines(records: Records) -> tuple[np.ndarray, np.ndarray]:
    """Return what lines leave of the forces [N], and the shapes of a loop and a bend.

    Of gears that are pulled it is that of the size of their force. Where the sizes of
    the shapes are l and b [N], the force is 2 l higher while loading, and b times
    `swings` of the second off its line.

    Args:
        records: the readings, shape (n,).

    Returns:
        Errors, shape (n,), and shapes, (2, n).
    """
    side = float(loading_side(np.asarray(records.deformation)) or 1)
    x, y = side * np.asarray(records.deformation), side * np.asarray(records.force)
    scaled = x / np.max(np.abs(x))
    shapes = side * np.asarray(records.sense), scaled * np.abs(scaled)
    shapes = [left_of_lines(records, each) for each in shapes]
    return left_of_lines(records, y), np.stack(shapes)


def _fitted(shapes: np.ndarray, error: np.ndarray, sd: np.ndarray):
    """Fit shapes to errors: sizes in the mean of all rows [N], and in standard errors.

    A shape that is none, or no other than those before it, has the size 0.
    """
    length = np.linalg.norm(shapes, axis=0)
    upper = np.linalg.qr(shapes, mode="r")
    own = np.abs(np.diag(upper)) > _OTHER * length
    own &= length > _NOTHING * np.sqrt(len(error))
    sizes, clear = np.zeros((2, shapes.shape[1]))
    if own.any():
        some = shapes[:, own]
        fit = np.linalg.inv(some.T @ some) @ some.T
        sizes[own] = fit @ error
        clear[own] = sizes[own] / np.linalg.norm(fit * sd, axis=1)
    return sizes, clear


def swings(curve: np.ndarray, gear: np.ndarray) -> np.ndarray:
    """Return from where to where a curve goes for each gear; NaN without readings."""
    low = np.full(1 + int(gear.max()), np.inf)
    high = -low
    np.minimum.at(low, gear, curve)
    np.maximum.at(high, gear, curve)
    return np.where(high >= low, high - low, np.nan)


def _correlation(error: np.ndarray, before: np.ndarray) -> float:
    follows, square = before >= 0, float(error @ error)
    pairs = int(follows.sum())
    if not pairs or square < _NOTHING:
        return 0.0
    tied = float(error[follows] @ error[before[follows]]) / pairs
    tied = min(tied * len(error) / square, _MOST_ALIKE)
    return tied if tied > max(_LITTLE, CLEAR / np.sqrt(pairs)) else 0.0


def misfit_words(found: Misfit) -> Iterator[str]:
    """Yield what is said of it, in sentences."""
    if found.loop_N:
        way = "higher" if found.loop_N > 0.0 else "lower"
        yield (
            f"In the mean of all gears the {{load}} is {abs(found.loop_N):.2g} {{N}} "
            f"{way} "
            "while the {displacement} increases than while it decreases, which "
            "counts as "
            "noise here."
        )
    if found.bend_N:
        way = "stiffens" if found.bend_N > 0.0 else "softens"
        yield (
            f"In the mean of all gears the curve {way} with the {{displacement}}, by "
            f"{abs(found.bend_N):.2g} {{N}} off straight lines, which counts as "
            "noise here."
        )
    if found.correlation:
        yield (
            f"Neighbouring readings err alike (correlation {found.correlation:.2f}): "
            "the interval of each gear is too narrow, by a factor of about "
            f"{found.widening:.1f}, and the numbers that call a gear off too sure."
        )
