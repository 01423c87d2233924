"""Loop and bend of each gear by itself, and how rare they are among the others."""

from typing import NamedTuple

import numpy as np

from hdcal.data.case import Case
from hdcal.fleets.misfit import beside_lines, swings
from hdcal.fleets.off_in import chance_of

# Square of a shape beside lines, in that of the gear with most of it, from which on a
# gear's own readings tell its size.
_TOLD = 0.05
# Square of a shape, of sizes about one, that rounding alone gives.
_NOTHING = 1e-9
# As so many degrees of freedom the noise of most counts beside that of a gear.
_POOLED = 8


class OwnShapes(NamedTuple):
    """What the readings of each gear have beside its straight lines; shape (g,) each.

    Attributes:
        loop: of loading above unloading; NaN where no reading tells it [N].
        bend: of the middle of the curve under its ends; likewise [N].
        chance: that an ordinary gear is as far out in either.
    """

    loop: np.ndarray
    bend: np.ndarray
    chance: np.ndarray


def own_shapes(case: Case, stiffness: np.ndarray) -> OwnShapes:
    """Return loop and bend of each gear, held against those of the others.

    What all gears have is no gear's own.

    Args:
        case: the readings; of a gear without any nothing is told.
        stiffness: of each gear, shape (g,) [N/mm as read].
    """
    gears = len(stiffness)
    if not len(case.records.force):
        nothing = np.full(gears, np.nan)
        return OwnShapes(nothing, nothing, np.ones(gears))
    gear, run = np.asarray(case.records.specimen), np.asarray(case.records.run)
    error, (way, curve) = beside_lines(case.records, stiffness)
    # Where loading and unloading differ in range, a bend is a loop in part.
    shared = np.nan_to_num(_slope(way, curve, gear, gears))
    beside = curve - shared[gear] * way
    bend = _slope(beside, error, gear, gears)
    loop = _slope(way, error, gear, gears) - shared * np.nan_to_num(bend)
    left = error - np.nan_to_num(loop)[gear] * way - np.nan_to_num(bend)[gear] * curve
    mounted = np.unique(np.stack([gear, run]), axis=1)[0]
    free = np.bincount(gear, minlength=gears) - np.bincount(mounted, minlength=gears)
    free = free - 1 - np.isfinite(loop) - np.isfinite(bend)
    noise = _noise(np.bincount(gear, left**2, gears), free)
    of_way, of_bend = (noise / _square(shape, gear, gears) for shape in (way, beside))
    of_loop = of_way + shared**2 * np.where(np.isfinite(bend), of_bend, 0.0)
    chances = _chance(loop, of_loop), _chance(bend, of_bend)
    # One of two is as far out by chance twice as often.
    chance = np.minimum(2.0 * np.minimum(*chances), 1.0)
    swing = np.pad(swings(curve, gear), (0, gears - 1 - gear.max()))
    return OwnShapes(2.0 * loop, swing * bend, chance)


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
