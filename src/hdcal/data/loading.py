"""Direction, sense and rate of the loading, and what the loading can show."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hdcal.screening.turning_points import (
    HOLD_MOST,
    HOLD_SHARE,
    TURN_MOST,
    TURN_SHARE,
    envelope,
    noise_sd,
    resting,
    rows_of_runs,
    turning_points,
)

# A movement counts as a half cycle, or as unloading, from this share of the range;
# two speeds are clearly different from this ratio. Less rest than the third share,
# in rows and in time, also comes about by chance at the top of a noisy sine.
_LARGE_MOVE, _CLEAR_RATIO, _LEAST_REST = 0.1, 1.5, 0.02
# One step back over this share of the range, twice as large as any before it, is where
# the next ramp begins: nothing was read on the way, so no unloading was measured.
_RESET_STEP = 0.5
# Rows of each branch that are compared with the row between them; four and more
# also show a curvature and a slope of each branch.
_MOST, _FEWEST, _CURVED = 8, 2, 4
# Prior probability that a turning row was read before the movement turned, as a rig
# does that stops at its set points.
_BEFORE = 0.99
_ROUNDING = 1e-9  # digits of a computed force


@dataclass(frozen=True)
class Motion:
    """Movement of the deformation, row by row, shape (n,), as in `Records`."""

    direction: np.ndarray
    sense: np.ndarray  # before any movement that of the first one, +1 without one
    rate: np.ndarray
    features: frozenset[str]  # those present among those in `Records.known`
    resets: tuple[int, ...] = ()  # rows reached by one step back over most of the range


class _Move(NamedTuple):
    """A movement between two reversals; row of the reset, if it is one."""

    sign: int
    travel: float
    speed: float
    reset: int | None


def loading_side(deformation: np.ndarray) -> int:
    """Return +1 for a gear that was pressed, -1 for one that was pulled, 0 for both."""
    ends = float(np.max(deformation)), float(-np.min(deformation))
    if min(ends) > _LARGE_MOVE * max(ends):
        return 0
    return 1 if ends[0] >= ends[1] else -1


def loading(deformation: np.ndarray, movement: np.ndarray) -> np.ndarray:
    """Return +1 away from the undeformed gear, 0 holding, -1 back to it, shape (n,)."""
    side = loading_side(deformation) or np.where(deformation < 0.0, -1, 1)
    return np.asarray(movement) * side


def movement_words(
    deformation: np.ndarray, name: str = "deformation"
) -> dict[int, str]:
    """Return the names of increasing (+1) and decreasing (-1) deformation."""
    side = loading_side(deformation)
    if side == 0:
        return {1: f"increasing {name}", -1: f"decreasing {name}"}
    return {side: "loading", -side: "unloading"}


def derive_motion(
    deformation: np.ndarray,
    run: np.ndarray,
    time: np.ndarray | None = None,
    *,
    hidden: bool = False,
) -> Motion:
    """Return the motion inside each run.

    Arrays are in the order in which they were taken, shape (n,); time does not decrease
    within a run. Where scatter hides the movement, every row counts as loading.
    """
    size = len(deformation)
    direction, rate, sense = np.zeros(size), np.zeros(size), np.ones(size)
    if hidden:
        return Motion(sense, sense, rate, frozenset())
    moves: list[list[_Move]] = []
    for rows in rows_of_runs(run):
        clock = None if time is None else time[rows]
        moves.append(_one_run(deformation[rows], clock, rows, direction, rate))
        if moves[-1]:
            # A rest keeps the sign of the last movement.
            moved, place = direction[rows] != 0, np.arange(rows.size)
            last = np.maximum.accumulate(np.where(moved, place, -1))
            first = moves[-1][0].sign
            sense[rows] = np.where(last >= 0, direction[rows][last], first)
    span = float(np.ptp(deformation)) if size else 0.0
    features = _features(moves, rate, span)
    if any(moves) and _rests(direction, run, time):
        features.add("holds")
    if features & {"holds", "rates"}:
        features.add("holds or rates")
    resets = [m.reset for run in moves for m in run if m.reset is not None]
    return Motion(direction, sense, rate, frozenset(features), tuple(sorted(resets)))


def _one_run(
    x: np.ndarray,
    time: np.ndarray | None,
    rows: np.ndarray,
    direction: np.ndarray,
    rate: np.ndarray,
) -> list[_Move]:
    """Fill in direction and rate of one run, and list its movements."""
    span = float(np.ptp(x)) if x.size else 0.0
    if span == 0.0:
        return []
    noise = noise_sd(x)
    threshold = min(max(TURN_SHARE * span, 10 * noise), TURN_MOST * span)
    tolerance = min(max(HOLD_SHARE * span, 8 * noise), HOLD_MOST * span)
    turns, sign = turning_points(x, threshold)
    moves = []
    for start, stop in zip([0, *turns], [*turns, x.size - 1], strict=True):
        # a reversal's row ends one movement and begins the next
        part = slice(start, stop + 1)
        rising = envelope(x[part], sign)
        held = resting(rising, tolerance)
        moving = ~held
        # the first row of a hold was moved to, also from the hold before it
        moving[1:] |= ~held[:-1] | (np.diff(rising) > tolerance)
        new = slice(1 if start else 0, None)
        direction[rows[part][new]] = np.where(moving, sign, 0)[new]
        speed = 0.0
        if time is not None:
            window = max(0.01 * span, 4 * tolerance)
            speeds = _speeds(rising, time[part], moving, window)
            rate[rows[part][new]] = np.where(moving, sign * speeds, 0.0)[new]
            speeds = speeds[moving & (speeds > 0)]
            speed = float(np.median(speeds)) if speeds.size else 0.0
        reset = _reset(x, start, stop, span)
        row = None if reset is None else int(rows[reset])
        moves.append(_Move(sign, float(rising[-1] - rising[0]), speed, row))
        sign = -sign
    return moves


def _reset(x: np.ndarray, start: int, stop: int, span: float) -> int | None:
    """Return the row at which one movement jumps back, None where it does not."""
    steps = np.abs(np.diff(x))
    row = start + 1 + int(np.argmax(steps[start:stop]))
    step = steps[row - 1]
    back = abs(x[row]) < abs(x[row - 1])
    before = steps[:start]
    fine = before.size >= 3 and float(before[-3:].max()) <= 0.5 * step
    return row if back and fine and step >= _RESET_STEP * span else None


def _speeds(
    rising: np.ndarray, time: np.ndarray, moving: np.ndarray, window: float
) -> np.ndarray:
    """Speed of one movement over a window of deformation around each row."""
    index = np.arange(rising.size)
    left = np.searchsorted(rising, rising - window / 2, "left")
    right = np.searchsorted(rising, rising + window / 2, "right") - 1
    # never across a hold, and at least over the step that led to the row
    block = np.cumsum(~moving)
    starts = np.searchsorted(block, block, "left")
    stops = np.searchsorted(block, block, "right") - 1
    left = np.minimum(np.maximum(left, starts), np.maximum(index - 1, 0))
    right = np.maximum(np.minimum(right, stops), index)
    right[0] = max(int(right[0]), min(1, rising.size - 1))
    elapsed = time[right] - time[left]
    moved = rising[right] - rising[left]
    speed = np.divide(moved, elapsed, out=np.zeros(rising.size), where=elapsed > 0)
    return np.where(moving, speed, 0.0)


def _rests(direction: np.ndarray, run: np.ndarray, time: np.ndarray | None) -> bool:
    """Tell whether the deformation was held in enough rows, or for long enough."""
    held = direction == 0
    if np.count_nonzero(held) < 2:
        return False
    if time is None or held.mean() >= _LEAST_REST:
        return bool(held.mean() >= _LEAST_REST)
    order = np.argsort(run, kind="stable")
    steps = np.where(np.diff(run[order]) == 0, np.diff(time[order]), 0.0)
    return bool(steps[held[order][1:]].sum() >= _LEAST_REST * steps.sum() > 0)


def _features(moves: list[list[_Move]], rate: np.ndarray, span: float) -> set[str]:
    """Return what the movements of all runs show, but for rests."""
    large = [[m for m in run if m.travel >= _LARGE_MOVE * span] for run in moves]
    every = [move for run in large for move in run]
    features = set()
    if {move.sign for move in every if move.reset is None} == {1, -1}:
        features.add("unloading")
    rising = [sum(move.sign > 0 for move in run) for run in large]
    if any(min(up, len(run) - up) >= 2 for up, run in zip(rising, large, strict=True)):
        features.add("cycles")
    speeds = [move.speed for move in every if move.speed > 0]
    if speeds and max(speeds) >= _CLEAR_RATIO * min(speeds):
        return features | {"rates"}
    # speeds within one movement, or a speed that changes all the time
    moving = np.abs(rate[rate != 0])
    if moving.size >= 3:
        slow, fast = np.quantile(moving, [0.1, 0.9])
        features |= {"rates"} if fast >= _CLEAR_RATIO * slow else set()
    return features


def sense_at_turns(
    sense: np.ndarray, deformation: np.ndarray, force: np.ndarray, run: np.ndarray
) -> np.ndarray:
    """Return the sense of the movement, with turning rows on the branch of their force.

    The deformation of a turning row does not show whether the movement had turned when
    the force was read; with friction the two forces differ by the width of the loop.
    The row gets the sense of the branch that predicts its force better: both branches
    are extrapolated from their nearest rows, the turning row left out. Arrays are
    shape (n,); `sense` counts a turning row before its turn.
    """
    order = np.argsort(run, kind="stable")
    x, y, sign = deformation[order], force[order], sense[order].copy()
    edges = np.flatnonzero((np.diff(sign) != 0) | (np.diff(run[order]) != 0)) + 1
    edges = np.array([0, *edges, sign.size])
    # The last row of a branch is the turning row, and belongs to none here.
    before, after = np.diff(edges)[:-1] - 1, np.diff(edges)[1:]
    after[:-1] -= 1
    rows = edges[1:-1] - 1
    turned = (run[order][rows] == run[order][rows + 1]) if rows.size else rows > 0
    count = np.where(turned, np.minimum(np.minimum(before, after), _MOST), 0)
    sizes = [size for size in range(_FEWEST, _MOST + 1) if np.any(count == size)]
    if not sizes:
        return sense
    fits = [_two_branches(x, y, rows[count == size], size) for size in sizes]
    freedom = sum(free for *_, free in fits)
    noise = np.sqrt(sum(squares for _, squares, _ in fits) / freedom)
    noise += _ROUNDING * np.max(np.abs(y))
    for size, (error, *_) in zip(sizes, fits, strict=True):
        score = np.log1p((error / noise) ** 2 / freedom)
        likelier = 0.5 * (freedom + 1) * (score[0] - score[1])
        late = rows[count == size][likelier > np.log(_BEFORE / (1.0 - _BEFORE))]
        sign[late] = sign[late + 1]
    senses = np.empty_like(sense)
    senses[order] = sign
    return senses


def _two_branches(
    x: np.ndarray, y: np.ndarray, at: np.ndarray, size: int
) -> tuple[np.ndarray, float, int]:
    """Return how two branches predict the force at the turning rows between them.

    Errors of the prediction from before and from after the turn, over their standard
    errors for a noise of one, shape (2, t); squares left, and degrees of freedom.
    """
    steps = np.concatenate([np.arange(-size, 0), np.arange(1, size + 1)])
    near = at[:, None] + steps
    u = x[near] - x[at][:, None]
    u /= np.maximum(np.max(np.abs(u), axis=1, keepdims=True), np.finfo(float).tiny)
    side = np.broadcast_to(np.sign(steps), u.shape)
    curved = [side * u, u**2] if size >= _CURVED else []
    design = np.stack([np.ones_like(u), side, u, *curved], axis=2)
    inverse = np.linalg.pinv(design)
    fitted = np.einsum("tpn,tn->tp", inverse, y[near])
    left = y[near] - np.einsum("tnp,tp->tn", design, fitted)
    ends = [inverse[:, 0] + way * inverse[:, 1] for way in (-1.0, 1.0)]
    errors = [
        (y[at] - np.sum(end * y[near], axis=1)) / np.sqrt(1.0 + np.sum(end**2, axis=1))
        for end in ends
    ]
    free = at.size * (2 * size - design.shape[2])
    return np.array(errors), float(np.sum(left**2)), free
