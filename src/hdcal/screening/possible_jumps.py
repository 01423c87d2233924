"""Places at which a zero may have jumped: both sides of the curve fail to meet."""

from dataclasses import dataclass

import numpy as np

from hdcal.screening.local_fit import (
    REACH,
    Usual,
    looked_at,
    median,
    resolution,
    slopes,
    spread,
    windows,
)
from hdcal.screening.turning_points import noise_sd

# Rows needed on each side of a jump; from fewer it could be anything.
SIDE = 4
# A smaller jump, as a share of the tested range, is left to the model's noise.
LEAST = 0.02
# Slopes on both sides agree when they differ by less than this share.
_ALIKE = 0.5
# A window moves one way when this share of its way is progress.
_PROGRESS = 0.6
# One step makes at least this share of the gap, and any other step about it at most
# the second share of that one.
_ONE_STEP, _OTHERS = 0.8, 0.5
_NEAR = np.r_[1 - REACH : 0, 1:REACH]
# A window rests that covers less than this share of what windows usually do.
_RESTS = 0.25


@dataclass(frozen=True)
class Sides:
    """Windows before and after each boundary, about the deformation between them."""

    x: tuple[np.ndarray, np.ndarray]
    y: tuple[np.ndarray, np.ndarray]
    slope: tuple[np.ndarray, np.ndarray]
    common: np.ndarray
    rests: tuple[np.ndarray, np.ndarray]

    @classmethod
    def at(cls, x: np.ndarray, y: np.ndarray, rows: np.ndarray) -> "Sides":
        """Return the windows about some boundaries, each before a row."""
        offsets = np.arange(-REACH, 0), np.arange(REACH)
        middle = 0.5 * (x[rows - 1] + x[rows])[:, None]
        before, after = offsets
        xs = windows(x, rows, before) - middle, windows(x, rows, after) - middle
        ys = windows(y, rows, before), windows(y, rows, after)
        pairs = [slopes(a, b) for a, b in zip(xs, ys, strict=True)]
        own = [median(each, 0.0) for each in pairs]
        common = median(np.hstack(pairs), 0.0)
        # at rest a line has no slope to speak of: that of the other side counts
        reach = [_reach(each) for each in xs]
        rests = [each < _RESTS * np.median(np.hstack(reach)) for each in reach]
        both = rests[0] & rests[1]
        first = np.where(rests[0], own[1], own[0])
        second = np.where(rests[1], own[0], own[1])
        common = np.where(rests[0], second, np.where(rests[1], first, common))
        first, second, common = (
            np.where(both, 0.0, each) for each in (first, second, common)
        )
        return cls(xs, ys, (first, second), common, (rests[0], rests[1]))

    def level(self, side: int, slope: np.ndarray) -> np.ndarray:
        """Return the force of one side's line midway between the two rows."""
        return median(self.y[side] - slope[:, None] * self.x[side])

    def gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much the sides fail to meet, with two slopes and with one."""
        own = self.level(1, self.slope[1]) - self.level(0, self.slope[0])
        return own, self.level(1, self.common) - self.level(0, self.common)


def possible_jumps(x: np.ndarray, y: np.ndarray, scatter: float) -> np.ndarray:
    """Return rows before which a zero may have jumped, the clearest first."""
    rows = looked_at(x, y)
    rows = rows[(rows >= SIDE) & (rows <= x.size - SIDE)]
    if rows.size < 2 * SIDE:
        return rows[:0]
    sides = Sides.at(x, y, rows)
    possible = _one_way(sides.x, sides, scatter)
    if scatter:
        # The force tells the way too, and trembles less.
        possible |= _one_way(sides.y, sides, noise_sd(y))
    own, common = sides.gaps()
    gap = np.where(possible, _least_gap(sides, own, common), 0.0)
    usual = Usual.of(common[_elsewhere(rows, gap, possible)], resolution(y))
    known = gap / _carried(x, y, rows, sides)
    off = off_sequence(x, rows) | off_sequence(y, rows)
    # A channel that leaves its own sequence says where a jump is, if there is one.
    found = usual.surprised(known, x.size)
    found |= off & usual.surprised(known, max(int(off.sum()), 1))
    found &= np.abs(gap) > LEAST * spread(y)
    found &= _alike(sides, usual.scale) & _in_one_step(x, y, rows, sides, gap)
    clearest = np.argsort(-np.where(found, np.abs(gap), 0.0))
    return rows[clearest[found[clearest]]]


def off_sequence(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Tell before which rows a channel steps as it does nowhere else about them."""
    steps = values[rows] - values[rows - 1]
    off = steps - median(windows(np.diff(values, prepend=values[0]), rows, _NEAR))
    return Usual.of(off, resolution(values)).surprised(off, values.size)


def _elsewhere(rows: np.ndarray, gap: np.ndarray, possible: np.ndarray) -> np.ndarray:
    """Tell which boundaries can say what is usual: none about the two largest gaps."""
    found = possible.copy()
    for _ in range(2):
        largest = rows[np.argmax(np.where(found, np.abs(gap), -1.0))]
        left = found & (np.abs(rows - largest) >= REACH)
        if left.sum() < 2 * REACH:
            break
        found = left
    return found


def _in_one_step(
    x: np.ndarray, y: np.ndarray, rows: np.ndarray, sides: Sides, gap: np.ndarray
) -> np.ndarray:
    """Tell where one step closes the gap and those about it keep to the curve."""
    offsets = np.arange(1 - REACH, REACH)
    rise, run = (windows(np.diff(v, prepend=v[0]), rows, offsets) for v in (y, x))
    off = np.abs(rise - sides.common[:, None] * run)
    step = off[:, REACH - 1].copy()
    off[:, REACH - 1] = 0.0
    with np.errstate(all="ignore"):
        others = np.nanmax(off, axis=1)
    return (step >= _ONE_STEP * np.abs(gap)) & (others <= _OTHERS * step)


def _carried(
    x: np.ndarray, y: np.ndarray, rows: np.ndarray, sides: Sides
) -> np.ndarray:
    """Return how many windows far both lines are carried on, 1 at least.

    Where both channels go along the curve by more than a window reaches, the error of
    its slope counts so many times.
    """
    run, rise = (np.abs(values[rows] - values[rows - 1]) for values in (x, y))
    reach = np.minimum(*(_reach(each) for each in sides.x))
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.fmin(run, rise / np.abs(sides.common))
        return np.fmax(both / reach, 1.0)


def _least_gap(sides: Sides, own: np.ndarray, common: np.ndarray) -> np.ndarray:
    """Return the force by which the two sides fail to meet, at its least.

    A continuous curve closes it with one slope or with two, or by a knee within a
    usual step of the deformation.
    """
    usual_step = median(np.abs(np.diff(np.hstack(sides.x), axis=1)))
    knee = np.abs(sides.slope[1] - sides.slope[0]) * usual_step
    size = np.minimum(np.abs(own), np.abs(common)) - knee
    return np.where(own * common > 0.0, np.sign(own) * np.maximum(size, 0.0), 0.0)


def _reach(x: np.ndarray) -> np.ndarray:
    """Return the range of the deformation in each window."""
    with np.errstate(all="ignore"):
        return np.nanmax(x, axis=1) - np.nanmin(x, axis=1)


def _one_way(
    values: tuple[np.ndarray, np.ndarray], sides: Sides, scatter: float
) -> np.ndarray:
    """Tell where both sides move the same way, or rest."""
    ways = []
    for each, rests in zip(values, sides.rests, strict=True):
        steps = np.diff(each, axis=1)
        way = np.nansum(steps, axis=1)
        path = np.nansum(np.abs(steps), axis=1)
        # steps of a gauge that trembles, 2/√π of its sd each
        shaken = 1.13 * scatter * np.sum(np.isfinite(steps), axis=1)
        moves = np.abs(way) >= _PROGRESS * (path - shaken)
        ways.append(np.where(rests, 0.0, np.where(moves, way, np.nan)))
    return ~np.isnan(ways[0] + ways[1]) & (ways[0] * ways[1] >= 0.0)


def _alike(sides: Sides, noise: float) -> np.ndarray:
    """Tell where the slopes on both sides agree, as far as the noise lets see it."""
    low, high = np.abs(sides.slope[0]), np.abs(sides.slope[1])
    reach = np.minimum(*(_reach(x) for x in sides.x))
    with np.errstate(divide="ignore"):
        blur = np.where(sides.rests[0] | sides.rests[1], np.inf, 4.0 * noise / reach)
    apart = np.abs(sides.slope[1] - sides.slope[0])
    return apart <= _ALIKE * np.maximum(low, high) + blur
