"""Jumps of a zero: from one row on, the same curve with another origin."""

from dataclasses import dataclass, replace

import numpy as np

from hdcal.screening.ends import noise_of
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
from hdcal.screening.turning_points import turning_points

# Rows needed on each side of a jump; from fewer it could be anything.
_SIDE = 4
# A smaller jump, as a share of the tested range, is left to the model's noise.
_LEAST = 0.02
# Slopes on both sides agree when they differ by less than this share.
_ALIKE = 0.5
# A window moves one way when this share of its way is progress.
_PROGRESS = 0.6
# Both channels jumped when one leaves its sequence at least this share as far.
_BOTH = 0.2
# One step makes at least this share of the gap, and any other step about it at most
# the second share of that one.
_ONE_STEP, _OTHERS = 0.8, 0.5
# Movements over this share of the range make a cycle, in so many of which a zero shows.
_CYCLE, _CYCLES = 0.1, 3
# Candidates that are tried, and the share of the range within which nothing moves.
_TRIED, _STILL = 5, 0.02
# A window rests that covers less than this share of what windows usually do.
_RESTS = 0.25


@dataclass(frozen=True)
class Jump:
    """A change of a zero before a row.

    Attributes:
        row: the first one after it.
        channel: `force`, `deformation` or `both`.
        deformation: by which it jumped; 0 where it did not.
        force: likewise.
    """

    row: int
    channel: str
    deformation: float
    force: float


@dataclass(frozen=True)
class _Sides:
    """Windows before and after each boundary, about the deformation between them."""

    x: tuple[np.ndarray, np.ndarray]
    y: tuple[np.ndarray, np.ndarray]
    slope: tuple[np.ndarray, np.ndarray]
    common: np.ndarray
    rests: tuple[np.ndarray, np.ndarray]

    @classmethod
    def at(cls, x: np.ndarray, y: np.ndarray, rows: np.ndarray) -> "_Sides":
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


def find_jump(x: np.ndarray, y: np.ndarray, scatter: float) -> Jump | None:
    """Return the clearest jump of a zero, or None.

    Where noise is larger than the steps between rows, means of rows tell more.

    Args:
        x: deformation, without wild readings, shape (n,).
        y: force, shape (n,).
        scatter: sd of the deformation's reading.
    """
    found = _find_jump(x, y, scatter)
    block = _block(y)
    for first in (0, block // 2) if found is None and block > 1 else ():
        edges = np.arange(first, x.size, block)
        means = [np.add.reduceat(v, edges)[:-1] / block for v in (x, y)]
        found = _find_jump(means[0], means[1], scatter / np.sqrt(block))
        if found is not None:
            near = np.arange(edges[found.row] - block, edges[found.row] + block + 1)
            return replace(found, row=_sharpest(x, y, near, found))
    return found


def _block(y: np.ndarray) -> int:
    """Return how many rows make noise smaller than the steps of their means."""
    noise = noise_of(y)
    lag = max(y.size // 20, 1)
    step = float(np.median(np.abs(y[lag:] - y[:-lag]))) / lag
    if step == 0.0:
        return 1
    return int(np.clip((2.0 * noise / step) ** (2.0 / 3.0), 1, y.size // 40 + 1))


def _sharpest(x: np.ndarray, y: np.ndarray, near: np.ndarray, jump: Jump) -> int:
    """Return the row of the largest step in the channel that jumped."""
    near = near[(near > 0) & (near < x.size)]
    values = x if jump.channel == "deformation" else y
    return int(near[np.argmax(np.abs(values[near] - values[near - 1]))])


def _find_jump(x: np.ndarray, y: np.ndarray, scatter: float) -> Jump | None:
    rows = looked_at(x, y)
    rows = rows[(rows >= _SIDE) & (rows <= x.size - _SIDE)]
    if rows.size < 2 * _SIDE:
        return None
    sides = _Sides.at(x, y, rows)
    possible = _one_way(sides, scatter)
    own, common = sides.gaps()
    gap = np.where(possible, _least_gap(sides, own, common), 0.0)
    whole = spread(y)
    usual = Usual.of(common[_elsewhere(rows, gap, possible)], resolution(y))
    found = usual.surprised(gap, x.size) & (np.abs(gap) > _LEAST * whole)
    found &= _alike(sides, usual.scale) & _in_one_step(x, y, rows, sides, gap)
    clearest = np.argsort(-np.where(found, np.abs(gap), 0.0))[:_TRIED]
    for place in clearest[found[clearest]]:
        jump = _jump(x, y, int(rows[place]), sides, place)
        after = np.arange(x.size) >= jump.row
        level = x - jump.deformation * after, y - jump.force * after
        if _goes_on(*level, jump.row) and _stays(*level, after, float(gap[place])):
            return jump
    return None


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


def _goes_on(x: np.ndarray, y: np.ndarray, row: int) -> bool:
    """Tell whether the curve goes on with the same slope, over many rows.

    A part that broke has another one, or none.

    Args:
        x: deformation, the jump taken out, shape (n,).
        y: force, likewise.
        row: the first one after it.
    """
    turns, _ = turning_points(x, _CYCLE * float(np.ptp(x)))
    edges = np.r_[0, turns, x.size]
    left = edges[edges <= row - _SIDE].max(initial=0)
    right = edges[edges >= row + _SIDE].min(initial=x.size)
    most = max(x.size // 4, REACH)
    lines = []
    for part in (slice(max(left, row - most), row), slice(row, min(right, row + most))):
        dx, dy = x[part] - x[part].mean(), y[part] - y[part].mean()
        square = float(dx @ dx)
        if np.ptp(dx) < _STILL * np.ptp(x):
            return True
        slope = float(dx @ dy) / square
        left_over = dy - slope * dx
        lines.append((slope, float(left_over @ left_over) / dx.size / square))
    (first, var_1), (second, var_2) = lines
    blur = 3.0 * np.sqrt(var_1 + var_2)
    return abs(first - second) <= _ALIKE * max(abs(first), abs(second)) + blur


def _stays(x: np.ndarray, y: np.ndarray, after: np.ndarray, gap: float) -> bool:
    """Tell whether all that comes after a jump is moved by it.

    A part that gives way in one cycle has another loop in the next one, but about the
    same centre; a zero that jumped moves the centre. Only cycles can tell.
    """
    span = float(np.ptp(x))
    turns, sign = turning_points(x, _CYCLE * span)
    if turns.size < _CYCLES:
        return True
    way = sign * (-1.0) ** np.searchsorted(turns, np.arange(x.size), "left")
    # of the cycles next to it
    first, last = np.searchsorted(turns, np.argmax(after)) + np.array(
        [-_CYCLES, _CYCLES]
    )
    ends = np.r_[0, turns, x.size]
    part = slice(ends[max(first + 1, 0)], ends[min(last + 1, ends.size - 1)])
    columns = np.column_stack([np.ones_like(x), x, way, after])[part]
    step = np.linalg.lstsq(columns, y[part], rcond=None)[0][3]
    return bool(abs(step) < 0.5 * abs(gap))


def _in_one_step(
    x: np.ndarray, y: np.ndarray, rows: np.ndarray, sides: _Sides, gap: np.ndarray
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


def _least_gap(sides: _Sides, own: np.ndarray, common: np.ndarray) -> np.ndarray:
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


def _one_way(sides: _Sides, scatter: float) -> np.ndarray:
    """Tell where both sides move the same way, or rest."""
    ways = []
    for each, rests in zip(sides.x, sides.rests, strict=True):
        steps = np.diff(each, axis=1)
        way = np.nansum(steps, axis=1)
        path = np.nansum(np.abs(steps), axis=1)
        # steps of a gauge that trembles, 2/√π of its sd each
        shaken = 1.13 * scatter * np.sum(np.isfinite(steps), axis=1)
        moves = np.abs(way) >= _PROGRESS * (path - shaken)
        ways.append(np.where(rests, 0.0, np.where(moves, way, np.nan)))
    return ~np.isnan(ways[0] + ways[1]) & (ways[0] * ways[1] >= 0.0)


def _alike(sides: _Sides, noise: float) -> np.ndarray:
    """Tell where the slopes on both sides agree, as far as the noise lets see it."""
    low, high = np.abs(sides.slope[0]), np.abs(sides.slope[1])
    reach = np.minimum(*(_reach(x) for x in sides.x))
    with np.errstate(divide="ignore"):
        blur = np.where(sides.rests[0] | sides.rests[1], np.inf, 4.0 * noise / reach)
    apart = np.abs(sides.slope[1] - sides.slope[0])
    return apart <= _ALIKE * np.maximum(low, high) + blur


def _jump(x: np.ndarray, y: np.ndarray, row: int, sides: _Sides, place: int) -> Jump:
    """Return a jump with the channel that leaves its own sequence."""
    off, ratio = [], []
    for values in (x, y):
        steps = np.diff(values[max(row - REACH, 0) : row + REACH])
        usual = float(np.median(steps))
        size = float(values[row] - values[row - 1]) - usual
        off.append(size)
        typical = float(np.median(np.abs(steps - usual))) + 0.5 * abs(usual)
        ratio.append(abs(size) / (typical + resolution(values)))
    gap, slope = float(sides.gaps()[1][place]), float(sides.common[place])
    if min(ratio) > _BOTH * max(ratio) and min(ratio) > 10.0:
        return Jump(row, "both", off[0], off[1])
    if ratio[1] >= ratio[0]:
        return Jump(row, "force", 0.0, gap)
    # where nothing moves the curve tells nothing of the deformation
    moved = min(float(np.nanmax(s[place]) - np.nanmin(s[place])) for s in sides.x)
    known = slope * moved > 0.1 * abs(gap)
    return Jump(row, "deformation", -gap / slope if known else off[0], 0.0)
