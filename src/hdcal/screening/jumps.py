"""Jumps of a zero: from one row on, the same curve with another origin."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hdcal.screening.local_fit import (
    REACH,
    Usual,
    looked_at,
    median,
    resolution,
    spread,
    windows,
)
from hdcal.screening.turning_points import noise_sd, turning_points

SIDE = 4  # rows needed on each side of a jump; from fewer it could be anything
# A smaller jump, as a share of the tested range, is left to the model's noise.
LEAST = 0.02
# A window moves one way when this share of its way is progress, and rests when it
# covers less than the second share of what windows usually do.
_PROGRESS, _RESTS = 0.6, 0.25
_OTHERS = 0.5  # any other step about a jump is at most this share of it
_NEAR = np.r_[1 - REACH : 0, 1:REACH]
_TRIED = 5  # places that are tried
_ALIKE = 0.5  # slopes on both sides agree when they differ by less than this share
_ONE_STEP = 0.8  # share of the gap between both sides of a jump that one step makes
_STILL = 0.02  # share of the range within which nothing moves
# Both channels jumped when one leaves its sequence at least this share as far, and by
# this many usual steps.
_BOTH, _FAR = 0.2, 10.0
_KNOWN = 5.0  # standard errors from which on a slope is known
_UNSURE = 3.0  # standard errors of a slope that two sides of a jump may differ by
_REAL = 0.2  # share of the movement that must be more than scatter
# Movements over this share of the range make a cycle, in so many of which a zero shows.
_CYCLE, _CYCLES = 0.1, 3
# A step that no movement explains is so many times as long as the larger range, or
# noise about one level would show some.
_BEYOND = 1.75


@dataclass(frozen=True)
class Jump:
    """A change of a zero before a row: the step of each channel, 0 where none."""

    row: int
    channel: Literal["force", "deformation", "both"]
    deformation: float
    force: float

    def __add__(self, other: "Jump") -> "Jump":
        """Return both jumps before the same row as one."""
        channel = self.channel if self.channel == other.channel else "both"
        deformation = self.deformation + other.deformation
        return Jump(self.row, channel, deformation, self.force + other.force)


def find_jump(x: np.ndarray, y: np.ndarray, scatter: float) -> Jump | None:
    """Return the clearest jump of a zero, or None.

    Where noise is larger than the steps between rows, means of rows tell more.
    """
    for block in sorted({1, max(_block(x), _block(y))}):
        for first in sorted({0, block // 2}):
            edges = np.arange(first, x.size, block)
            mean_x, mean_y = (
                values if block == 1 else np.add.reduceat(values, edges)[:-1] / block
                for values in (x, y)
            )
            blur = scatter / np.sqrt(block)
            for place, turns in _possible(mean_x, mean_y, blur)[:_TRIED]:
                row = int(edges[place])
                if block > 1:
                    near = np.arange(row - block, row + block + 1)
                    row = _sharpest(x, y, near[(near > 0) & (near < x.size)])
                jump = _jump(x, y, row, REACH * block, scatter, in_cycles=turns)
                if jump is not None:
                    return jump
    return _beyond_all(x, y, scatter)


def _possible(x: np.ndarray, y: np.ndarray, scatter: float) -> list[tuple[int, bool]]:
    """Return rows before which a zero may have jumped, the clearest first.

    A channel steps there as it does nowhere else near. Where the movement turns, which
    is returned with the row, only one channel may do so.
    """
    rows = looked_at(x, y)
    rows = rows[(rows >= SIDE) & (rows <= x.size - SIDE)]
    if rows.size < 2 * SIDE:
        return []
    (off_x, far_x), (off_y, far_y) = _off(x, rows), _off(y, rows)
    straight = _one_way(x, rows, scatter)
    if scatter:
        # The force shows the way too, and trembles less.
        straight |= _one_way(y, rows, noise_sd(y))
    found = np.where(straight, off_x | off_y, off_x != off_y)
    clearest = np.argsort(-np.maximum(far_x, far_y))
    clearest = clearest[found[clearest]]
    return [*zip(rows[clearest].tolist(), (~straight[clearest]).tolist(), strict=True)]


def _off(values: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    steps = values[rows] - values[rows - 1]
    near = windows(np.diff(values, prepend=values[0]), rows, _NEAR)
    level = median(near)
    off = steps - level
    usual = Usual.of(off, resolution(values))
    with np.errstate(all="ignore"):
        others = np.nanmax(np.abs(near - level[:, None]), axis=1)
    alone = others <= _OTHERS * np.abs(off)
    return usual.surprised(off, values.size) & alone, np.abs(off) / usual.scale


def _one_way(values: np.ndarray, rows: np.ndarray, scatter: float) -> np.ndarray:
    """Tell where a channel moves the same way before and after a row, or rests."""
    sides = [windows(values, rows, o) for o in (np.arange(-REACH, 0), np.arange(REACH))]
    with np.errstate(all="ignore"):
        reach = [np.nanmax(each, axis=1) - np.nanmin(each, axis=1) for each in sides]
    rests = [each < _RESTS * np.median(np.hstack(reach)) for each in reach]
    ways = []
    for each, still in zip(sides, rests, strict=True):
        steps = np.diff(each, axis=1)
        way, path = np.nansum(steps, axis=1), np.nansum(np.abs(steps), axis=1)
        # steps of a gauge that trembles, 2/√π of its sd each
        shaken = 1.13 * scatter * np.sum(np.isfinite(steps), axis=1)
        moves = np.abs(way) >= _PROGRESS * (path - shaken)
        ways.append(np.where(still, 0.0, np.where(moves, way, np.nan)))
    return ~np.isnan(ways[0] + ways[1]) & (ways[0] * ways[1] >= 0.0)


def _beyond_all(x: np.ndarray, y: np.ndarray, scatter: float) -> Jump | None:
    """Return a jump of one channel alone by more than its ranges before and after."""
    rows = np.arange(SIDE, x.size - SIDE)
    longer = []
    for values in (x, y):
        ranges = [
            np.maximum.accumulate(way) - np.minimum.accumulate(way)
            for way in (values, values[::-1])
        ]
        most = np.maximum(ranges[0][rows - 1], ranges[1][::-1][rows])
        longer.append(np.abs(values[rows] - values[rows - 1]) > _BEYOND * most)
    found = rows[longer[0] != longer[1]]
    return _measured(x, y, int(found[0]), REACH, scatter) if found.size else None


def _block(values: np.ndarray) -> int:
    """Return how many rows make noise smaller than the steps of their means."""
    noise = noise_sd(values, fewest=3)
    lag = max(values.size // 20, 1)
    step = float(np.median(np.abs(values[lag:] - values[:-lag]))) / lag
    if step == 0.0:
        return 1
    return int(np.clip((2.0 * noise / step) ** (2.0 / 3.0), 1, values.size // 40 + 1))


def _sharpest(x: np.ndarray, y: np.ndarray, near: np.ndarray) -> int:
    """Return the row at which one channel leaves its sequence by the largest step."""
    off = np.zeros(near.size)
    for values in (x, y):
        step = np.abs(values[near] - values[near - 1])
        off = np.maximum(off, step / (np.median(step) + resolution(values)))
    return int(near[np.argmax(off)])


def _jump(
    x: np.ndarray,
    y: np.ndarray,
    row: int,
    reach: int,
    scatter: float,
    *,
    in_cycles: bool,
) -> Jump | None:
    """Return the jump before a row, None where the curve does not go on after it."""
    if not in_cycles and not _in_one_step(x, y, row, reach, scatter):
        return None
    jump = _measured(x, y, row, reach, scatter)
    small = abs(jump.deformation) < LEAST * spread(x)
    if small and abs(jump.force) < LEAST * spread(y):
        return None
    after = np.arange(x.size) >= row
    level = x - jump.deformation * after, y - jump.force * after
    # through the scatter of the deformation
    least = max(_CYCLE * float(np.ptp(level[0])), 10.0 * scatter)
    turns = turning_points(level[0], least)
    movements = turns[0].size + 1
    if in_cycles and (movements <= _CYCLES or x.size < 2 * REACH * movements):
        return None
    real = _goes_on(*level, row, turns[0])
    return jump if real and _stays(*level, after, jump, turns) else None


def _measured(
    x: np.ndarray, y: np.ndarray, row: int, reach: int, scatter: float
) -> Jump:
    """Return a jump with its size, in the channel that leaves its sequence."""
    sides = slice(max(row - reach, 0), row), slice(row, row + reach)
    dx, dy = (
        np.concatenate([values[side] - values[side].mean() for side in sides])
        for values in (x, y)
    )
    square = float(dx @ dx)
    real = square - dx.size * scatter**2
    slope = float(dx @ dy) / real if real > _REAL * square else 0.0
    left = dy - slope * dx
    known = slope * np.sqrt(square) > _KNOWN * np.sqrt(left @ left / dx.size)
    run, rise = (float(v[sides[1]].mean() - v[sides[0]].mean()) for v in (x, y))
    off, ratio = [], []
    for values in (x, y):
        steps = np.diff(values[max(row - REACH, 0) : row + REACH])
        usual = float(np.median(steps))
        off.append(float(values[row] - values[row - 1]) - usual)
        typical = float(np.median(np.abs(steps - usual))) + 0.5 * abs(usual)
        ratio.append(abs(off[-1]) / (typical + resolution(values)))
    # A part that is set back goes along its curve, as far as the slope is known.
    blur = np.sqrt(left @ left / dx.size / max(square, 1e-300)) * abs(off[0])
    along = abs(off[1] - slope * off[0]) <= LEAST * spread(y) + _UNSURE * blur
    if min(ratio) > max(_BOTH * max(ratio), _FAR) and not along:
        return Jump(row, "both", off[0], off[1])
    if ratio[1] >= ratio[0]:
        return Jump(row, "force", 0.0, rise - slope * run if known else off[1])
    return Jump(row, "deformation", run - rise / slope if known else off[0], 0.0)


def _in_one_step(
    x: np.ndarray, y: np.ndarray, row: int, reach: int, scatter: float
) -> bool:
    """Tell whether one step makes up the gap of both sides; at a knee several do."""
    before, after = slice(max(row - reach, 0), row), slice(row, row + reach)
    runs = [np.diff(x[part]) for part in (before, after)]
    rises = [np.diff(y[part]) for part in (before, after)]
    run, rise = np.concatenate(runs), np.concatenate(rises)
    moved = run != 0.0
    slope = float(np.median(rise[moved] / run[moved])) if moved.any() else 0.0
    left = y - slope * x
    gap = float(np.median(left[after]) - np.median(left[before]))
    blur = noise_sd(y, fewest=3) + abs(slope) * scatter
    return abs(left[row] - left[row - 1]) + 4.0 * blur >= _ONE_STEP * abs(gap)


def _goes_on(x: np.ndarray, y: np.ndarray, row: int, turns: np.ndarray) -> bool:
    """Tell whether the curve goes on with the same slope; a broken part does not."""
    edges = np.r_[0, turns, x.size]
    left = edges[edges <= row - SIDE].max(initial=0)
    right = edges[edges >= row + SIDE].min(initial=x.size)
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


def _stays(
    x: np.ndarray,
    y: np.ndarray,
    after: np.ndarray,
    jump: Jump,
    turning: tuple[np.ndarray, int],
) -> bool:
    """Tell whether all that comes after a jump is moved by it.

    A part that gives way in one cycle has another loop in the next one, but about the
    same centre; a zero that jumped moves the centre. Only cycles can tell.
    """
    turns, sign = turning
    if turns.size < _CYCLES:
        return True
    way = sign * (-1.0) ** np.searchsorted(turns, np.arange(x.size), "left")
    # of the cycles next to it
    turn = int(np.searchsorted(turns, np.argmax(after)))
    first, last = turn - _CYCLES, turn + _CYCLES
    ends = np.r_[0, turns, x.size]
    part = slice(ends[max(first + 1, 0)], ends[min(last + 1, ends.size - 1)])
    columns = np.column_stack([np.ones_like(x), x, way, after])[part]
    _, slope, _, step = np.linalg.lstsq(columns, y[part], rcond=None)[0]
    return bool(abs(step) < 0.5 * (abs(jump.force) + abs(slope * jump.deformation)))
