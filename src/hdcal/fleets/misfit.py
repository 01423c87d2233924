"""What straight lines leave over, in all gears together: a bend, a loop, neighbours."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.inference.serial_correlation import previous_rows
from hdcal.report.answer import Real

# Standard errors from which on something is said: of three tests in no fleet by chance.
_CLEAR = 4.0
# What is smaller is not worth saying: in noise sds, and as a correlation.
_SMALL, _LITTLE = 0.2, 0.2
# Length of a shape, of sizes about one, that rounding alone gives.
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


def misfit(case: Case, stiffness: np.ndarray, noise_sd: np.ndarray) -> Misfit:
    """Return what readings have beside straight lines with a zero for each mounting.

    Args:
        case: the readings.
        stiffness: of each gear, shape (g,) [N/mm as read].
        noise_sd: of each gear, shape (g,) [N].
    """
    records = case.records
    gear = np.asarray(records.specimen)
    labels = np.stack([gear, np.asarray(records.run)])
    mounting = np.unique(labels, axis=1, return_inverse=True)[1]
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    sd, rows = noise_sd[gear], np.bincount(mounting)

    def within(values: np.ndarray) -> np.ndarray:
        return values - (np.bincount(mounting, values) / rows)[mounting]

    error = within(y - stiffness[gear] * x) / sd
    line = within(x)
    # A gear's slope is fitted: it takes up what goes along with the deformation.
    squares = np.bincount(gear, line**2)

    def beside_lines(values: np.ndarray) -> np.ndarray:
        values = within(values)
        return values - (np.bincount(gear, values * line) / squares)[gear] * line

    error = beside_lines(error)
    ways, curve = beside_lines(np.asarray(records.sense)), beside_lines(x * np.abs(x))
    loop, bend = _size(ways / sd, error), _size(curve / sd, error)
    # What the two explain is no correlation.
    error = error - (loop * ways + bend * curve) / sd
    loop, bend = 2.0 * loop, float(np.ptp(curve)) * bend
    return Misfit(_correlation(error, previous_rows(records)), loop, bend)


def _size(shape: np.ndarray, error: np.ndarray) -> float:
    """Return the coefficient of a shape in errors of sd one; 0 where it is not seen."""
    length = float(np.sqrt(shape @ shape))
    if length < _NOTHING:
        return 0.0
    clear = float(shape @ error) / length
    small = _SMALL * np.sqrt(len(error))
    return clear / length if abs(clear) > max(_CLEAR, small) else 0.0


def _correlation(error: np.ndarray, before: np.ndarray) -> float:
    follows = before >= 0
    pairs = int(follows.sum())
    if not pairs:
        return 0.0
    tied = float(error[follows] @ error[before[follows]]) / pairs
    tied /= float(error @ error) / len(error)
    return tied if tied > max(_LITTLE, _CLEAR / np.sqrt(pairs)) else 0.0


def misfit_words(found: Misfit) -> Iterator[str]:
    """Yield what is said of it, in sentences."""
    if found.loop_N:
        way = "higher" if found.loop_N > 0.0 else "lower"
        yield (
            f"In the mean of all gears the force is {abs(found.loop_N):.2g} N {way} "
            "while the deformation increases than while it decreases, which counts as "
            "noise here."
        )
    if found.bend_N:
        way = "stiffens" if found.bend_N > 0.0 else "softens"
        yield (
            f"In the mean of all gears the curve {way} with the deformation, by "
            f"{abs(found.bend_N):.2g} N off straight lines, which counts as noise here."
        )
    if found.correlation:
        yield (
            f"Neighbouring readings err alike (correlation {found.correlation:.2f}): "
            "the interval of each gear is too narrow, by a factor of about "
            f"{found.widening:.1f}, and the numbers that call a gear off too sure."
        )
