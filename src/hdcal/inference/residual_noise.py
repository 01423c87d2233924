"""Whether residuals are noise as the model has it: independent, and alike at any force.

Tested on what the model and every shape that was found leave.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr, stdtr

from hdcal.data.records import Records
from hdcal.data.scatter import least_step
from hdcal.inference.noise_form import growth_p_value
from hdcal.inference.residual_shapes import (
    FALSE_ALARM,
    Structure,
    Whitened,
    orthonormal,
)
from hdcal.inference.serial_correlation import previous_rows, whiten

# Fewer rows say nothing of their noise.
_LEAST_ROWS = 12
NEIGHBOURS, SCATTER, WILD = "neighbours", "scatter", "wild readings"
# A normal sd over the median of absolute errors, and what that median is worth: as much
# as the sd of so large a share of the errors.
_NORMAL, _WORTH = 1.4826, 0.37
# Errors that lie nearer are those of noise with long tails, of which a slip is none; it
# has so large a share of all squares, and there are few: jumps of a rig are many.
_WILD, _SHARE, _FEW = 12.0, 0.02, 3
# Name, p value, size [N], words.
_Test = tuple[str, float, float, str]


@dataclass(frozen=True)
class _Left:
    """What is left of the rows, in noise sds.

    Attributes:
        error: with the rows of the priors below those of the data, (n + p,).
        basis: orthonormal, of all that was absorbed, (n + p, q).
    """

    error: np.ndarray
    basis: np.ndarray

    @property
    def free(self) -> int:
        """Degrees of freedom."""
        return len(self.error) - self.basis.shape[1]


def noise_faults(
    data: Whitened,
    records: Records,
    sd: np.ndarray,
    *,
    rounded: bool,
    mixed: bool = False,
    correlation: float = 0.0,
) -> tuple[Structure, ...]:
    """Find out in which ways residuals are not the noise that the model has.

    Args:
        data: residuals and what was absorbed, shapes that were found included.
        records: the rows.
        sd: noise sd of each row [N].
        rounded: whether steps of the reading are wider than its noise; neighbours
            are then alike without any correlation.
        mixed: whether the model expects wild readings.
        correlation: of neighbouring readings in the model [-].

    Returns:
        What was found, at a family-wise error of `FALSE_ALARM`.
    """
    if len(sd) < _LEAST_ROWS:
        return ()
    before = previous_rows(records)
    # Squares of correlated errors come in waves, which pass for growth.
    rest = _left(_independent(data, before, correlation))
    tests = [_scatter(rest, records, sd)]
    if not rounded and not mixed:
        new = np.sqrt(1.0 - correlation**2 * (before >= 0))
        tests.append(_wild(rest, records, new * sd))
    if not rounded and np.any(before >= 0):
        tests.append(_neighbours(rest, before, sd, correlation))
    return tuple(
        Structure(name, min(1.0, p * len(tests)), size, words)
        for name, p, size, words in tests
        if p * len(tests) <= FALSE_ALARM
    )


def _left(data: Whitened) -> _Left:
    """Return what residuals leave beside all that was absorbed."""
    basis = orthonormal(data.absorbed)
    return _Left(data.residual - basis @ (basis.T @ data.residual), basis)


def _independent(data: Whitened, before, correlation: float) -> Whitened:
    """Return data as they are where the noise of the model is independent."""

    def white(table: np.ndarray) -> np.ndarray:
        rows = whiten(table[: len(before)], before, correlation)
        return np.concatenate([rows, table[len(before) :]])

    absorbed, residual = white(data.absorbed), white(data.residual)
    return replace(data, absorbed=absorbed, residual=residual)


def _neighbours(rest: _Left, before, sd: np.ndarray, correlation: float) -> _Test:
    """Test whether neighbouring rows of a run err alike, beyond a known correlation.

    The ratio of quadratic forms has its exact mean and variance under independence,
    as in Durbin and Watson, Biometrika 37 (1950).
    """
    size, (follows,) = len(sd), np.nonzero(before >= 0)
    followed = before[follows]

    def shifted(table: np.ndarray) -> np.ndarray:
        """Return half the row after and half the row before, within runs."""
        moved = np.zeros_like(table)
        moved[followed] += 0.5 * table[follows]
        moved[follows] += 0.5 * table[followed]
        return moved

    moved, free, pairs = shifted(rest.basis), rest.free, len(follows)
    held = rest.basis.T @ moved
    trace = -float(np.trace(held))
    square = 0.5 * pairs - 2.0 * float(np.sum(moved**2)) + float(np.sum(held**2))
    ratio = float(rest.error @ shifted(rest.error[:, None])[:, 0])
    ratio /= float(rest.error @ rest.error)
    mean = trace / free
    variance = 2.0 * (free * square - trace**2) / (free**2 * (free + 2.0))
    p = float(ndtr((mean - ratio) / np.sqrt(variance)))
    alike = float(np.clip((ratio - mean) * free / pairs, 0.0, 0.95))
    times = np.sqrt((1.0 + alike) / (1.0 - alike))
    rms = float(np.sqrt(np.mean((rest.error[:size] * sd) ** 2)))
    beyond = f" beyond the model's {correlation:.2f}" if correlation >= 0.005 else ""
    words = (
        f"Neighbouring readings err alike (correlation {alike:.2f}{beyond}): the "
        f"intervals of stiffness and mean {{load}} are some {times:.1f} times too "
        "narrow."
    )
    return NEIGHBOURS, p, alike * rms, words


def _wild(rest: _Left, records: Records, sd: np.ndarray) -> _Test:
    """Test whether a reading lies farther off than noise ever does, as slips do.

    Against the median of all, which a few wild ones do not move, and the rounding of a
    display, below which the median may lie.

    Args:
        rest: what is left of the rows.
        records: the rows.
        sd: of what each row errs beside the one before [N].
    """
    size = len(sd)
    kept = 1.0 - np.sum(rest.basis[:size] ** 2, axis=1)
    far = np.abs(rest.error[:size]) / np.sqrt(np.maximum(kept, 1e-6))
    rounding = least_step(records.force) / np.sqrt(12.0)
    scale = np.maximum(_NORMAL * float(np.median(far)), rounding / sd)
    times = far / np.maximum(scale, 1e-300)
    chance = 2.0 * size * stdtr(_WORTH * rest.free, -times)
    row = int(np.argmax(far))
    wild = np.flatnonzero((chance <= FALSE_ALARM) & (times >= _WILD))
    # What comes after one errs beside it.
    many = int(np.sum(np.diff(wild, prepend=-2) > 1))
    slips = many <= _FEW and far[row] ** 2 >= _SHARE * float(far @ far)
    chance = chance if len(wild) and slips else np.ones(size)
    others = f" ({many} such readings)" * (many > 1)
    off = float(far[row] * sd[row])
    force, place = (float(v[row]) for v in (records.force, records.deformation))
    words = (
        f"Reading {row + 1}, {force:.4g} {{N}} at {place:.4g} "
        f"{{mm}}, lies {off:.3g} {{N}} off, "
        f"{times[row]:.0f} times as far as readings scatter{others}: all that is said "
        "here may be off."
    )
    return WILD, min(1.0, float(chance[row])), off, words


def _scatter(rest: _Left, records: Records, sd: np.ndarray) -> _Test:
    """Test whether readings scatter more the farther the gear is deformed."""
    size, far = len(sd), np.abs(np.asarray(records.deformation))
    kept = 1.0 - np.sum(rest.basis[:size] ** 2, axis=1)
    square = rest.error[:size] ** 2 / np.maximum(kept, 1e-6)
    p = growth_p_value(square, far)
    thirds = np.quantile(far, [1 / 3, 2 / 3])
    near, farther = (
        float(np.sqrt(np.mean(square[rows] * sd[rows] ** 2)))
        for rows in (far <= thirds[0], far >= thirds[1])
    )
    words = (
        f"Readings scatter more at larger {{load}}s ({near:.2g} {{N}} in the "
        f"lower third, {farther:.2g} {{N}} in the upper one): bounds at large "
        "{load}s are too low."
    )
    return SCATTER, p, farther - near, words
