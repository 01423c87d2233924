"""Loop and bend of each gear by itself, and how rare they are among the others."""

from typing import NamedTuple

import numpy as np

from hdcal.data.case import Case
from hdcal.fleets.misfit import CLEAR, beside_lines, swings
from hdcal.fleets.off_in import chance_of

# Square of a shape beside lines, in that of the gear with most of it, from which on a
# gear's own readings tell its size.
_TOLD = 0.05
# Square of a shape, of sizes about one, that rounding alone gives.
_NOTHING = 1e-9
# Noise beside a loop over that beside lines that rounding alone gives: it has a
# logarithm.
_LEAST_RATIO = 1e-6
# As so many degrees of freedom the noise of most counts beside that of a gear.
_POOLED = 8


class OwnShapes(NamedTuple):
    """What the readings of each gear have beside its straight lines; shape (g,) each.

    Attributes:
        loop: of loading above unloading; NaN where no reading tells it [N].
        bend: of the middle of the curve under its ends; likewise [N].
        chance: that an ordinary gear is as far out in either.
        clear: sizes of both, as `beside_lines` has them, where they are clearly there;
            NaN elsewhere; shape (2, g) [N].
        noise_ratio: of the noise beside what is clearly there to that beside lines.
    """

    loop: np.ndarray
    bend: np.ndarray
    chance: np.ndarray
    clear: np.ndarray
    noise_ratio: np.ndarray


def own_shapes(case: Case) -> OwnShapes:
    """Return loop and bend of each gear, held against those of the others.

    What all gears have is no gear's own.

    Args:
        case: the readings; of a gear without any nothing is told.
    """
    gears = len(case.specimen_labels)
    if not len(case.records.force):
        nothing, ones = np.full((2, gears), np.nan), np.ones(gears)
        return OwnShapes(nothing[0], nothing[1], ones, nothing, ones)
    gear, run = np.asarray(case.records.specimen), np.asarray(case.records.run)
    error, (way, curve) = beside_lines(case.records)
    # Where loading and unloading differ in range, a bend is a loop in part.
    shared = np.nan_to_num(_slope(way, curve, gear, gears))
    beside = curve - shared[gear] * way
    bend = _slope(beside, error, gear, gears)
    loop = _slope(way, error, gear, gears) - shared * np.nan_to_num(bend)
    mounted = np.unique(np.stack([gear, run]), axis=1)[0]
    free = np.bincount(gear, minlength=gears) - np.bincount(mounted, minlength=gears)

    def left(sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return squares that are left beside shapes, and degrees of freedom."""
        own = np.nan_to_num(sizes)[:, gear]
        rest = error - own[0] * way - own[1] * curve
        used = 1 + np.isfinite(sizes).sum(axis=0)
        return np.bincount(gear, rest**2, gears), free - used

    sizes = np.stack([loop, bend])
    noise = _noise(*left(sizes))
    of_way, of_bend = (noise / _square(shape, gear, gears) for shape in (way, beside))
    of_loop = of_way + shared**2 * np.where(np.isfinite(bend), of_bend, 0.0)
    chances = _chance(loop, of_loop), _chance(bend, of_bend)
    # One of two is as far out by chance twice as often.
    chance = np.minimum(2.0 * np.minimum(*chances), 1.0)
    swing = np.pad(swings(curve, gear), (0, gears - 1 - gear.max()))
    clear = np.where(sizes**2 > CLEAR**2 * np.stack([of_loop, of_bend]), sizes, np.nan)
    ratio = _noise_ratio(left(clear), left(np.full_like(sizes, np.nan)))
    return OwnShapes(2.0 * loop, swing * bend, chance, clear, ratio)


def _noise_ratio(beside, lines) -> np.ndarray:
    """Return the ratio of two noise sds, each of squares and degrees of freedom."""
    told = (beside[1] > 0) & (lines[0] > 0.0)
    variances = [
        np.where(told, s, 1.0) / np.where(told, f, 1) for s, f in (beside, lines)
    ]
    return np.maximum(np.sqrt(variances[0] / variances[1]), _LEAST_RATIO)


def _square(shape: np.ndarray, gear: np.ndarray, gears: int) -> np.ndarray:
    """Return the sum of squares of each gear, no less than rounding leaves."""
    return np.maximum(np.bincount(gear, shape**2, gears), _NOTHING)


def _slope(
    shape: np.ndarray, values: np.ndarray, gear: np.ndarray, gears: int
) -> np.ndarray:
    """Return the size of a shape in the values of each gear; NaN where nothing tells.

    Of a shape that no gear's readings tell it is nought.
    """
    square = _square(shape, gear, gears)
    seen = square > max(_TOLD * square.max(), _NOTHING)
    size = np.full(gears, np.nan)
    size[seen] = np.bincount(gear, shape * values, gears)[seen] / square[seen]
    return size


def _noise(squares: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the variance of the noise of each gear; infinite where nothing tells it.

    A few readings misjudge it: that of most counts as so many degrees of freedom.

    Args:
        squares: of what lines and shapes leave, summed.
        free: degrees of freedom of these.

    Source:
        Smyth, Statistical Applications in Genetics and Molecular Biology 3 (2004).
    """
    told = free > 0
    if not told.any():
        return np.full(len(squares), np.inf)
    most = float(np.median(squares[told] / free[told]))
    found = (squares + _POOLED * most) / (np.maximum(free, 0) + _POOLED)
    return np.where(told, found, np.inf)


def _chance(size: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return the chance of each gear that an ordinary one's size is as far out.

    Args:
        size: of a shape [N].
        variance: of its error; infinite where nothing tells it.
    """
    chance = np.ones(len(size))
    told = np.isfinite(size) & np.isfinite(variance)
    if told.any():
        found = size[told]
        far = np.abs(found - np.median(found))
        chance[told] = chance_of(found, far, variance[told])
    return chance
