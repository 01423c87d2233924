"""Evidence of rounded readings: all of them lie on a grid coarser than their digits."""

from collections.abc import Iterator

import numpy as np

from hdcal.evidence.prepare import PreparedCase

# Readings are written at least this much finer than their noise, or else on purpose.
_WRITTEN = 20.0
# Steps below this share of the noise do no harm and leave no trace.
_LEAST_STEP = 0.2
# Rounding to a step scatters by step/√12: a coarser one is of forces that were set,
# not read, and its multiples say nothing of the instrument.
_MOST_STEP = 1.5 * np.sqrt(12.0)
# Steps are at least this many of the last digit; the line through counts settles soon.
_APART, _REFINEMENTS = 20.0, 6
# Values of more significant digits are written in full.
_MOST_DIGITS = 9
_NEAR_ZERO = 1e-3


def quantisation_evidence(case: PreparedCase) -> tuple[float, float]:
    """Return the log evidence of readings on a coarse grid against none, and its step.

    Readings off the grid are impossible there; on it each stands for its interval.
    Without the grid readings fall anywhere on the finest scale that they can show.

    Args:
        case: whose readings are looked at.

    Returns:
        Log evidence [nat], −∞ where there is no such grid, and the step [N].
    """
    sd = float(case.priors["quantisation.step"].numbers[-1])
    readings = np.asarray(case.records.force)
    step, finest = rounding_step(readings, case.noise_sd)
    if not _LEAST_STEP <= step / case.noise_sd <= _MOST_STEP:
        return -np.inf, 0.0
    # A step above the noise hides most of it: an interval then has probability one.
    gain = len(readings) * np.log(min(step, 2.0 * case.noise_sd) / finest)
    prior = -0.5 * (step / (3.0 * sd)) ** 2 + np.log(finest / (3.0 * sd))
    return float(gain + prior), step


def rounding_step(readings: np.ndarray, noise_sd: float) -> tuple[float, float]:
    """Return the step on which all readings lie, and the step they are written in.

    Args:
        readings: force as read [N], shape (n,).
        noise_sd: of a reading [N].

    Returns:
        Largest step between readings, all of which lie on a grid of it, and the
        finest one that they can show [N]; the first is 0 when it is none above.
    """
    finest = noise_sd / _WRITTEN
    counted = _counted_step(np.asarray(readings, float))
    if counted > finest:
        return counted, finest
    digits = int(np.clip(np.ceil(-np.log10(noise_sd)) + 4, 0, 9))
    whole = np.round(np.asarray(readings) * 10.0**digits).astype(np.int64)
    step = np.gcd.reduce(np.abs(whole)) / 10.0**digits
    return (float(step), finest) if step > finest else (0.0, finest)


def _counted_step(readings: np.ndarray) -> float:
    """Return the step of counts that were scaled and then written with few digits.

    Zero and step are those of the line through the counts; every reading lies on it
    as closely as it was written down, with so many decimals or with so many digits. 0
    where there is no such step.
    """
    values = np.unique(readings)
    if not values.any():
        return 0.0
    steps = (_step_between(values, written) for written in _last_digits(values))
    return max(steps, default=0.0)


def _last_digits(values: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the worth of the last digit that each value may have been written with."""
    for decimals in range(10):
        if np.array_equal(np.round(values, decimals), values):
            yield np.full(len(values), 10.0**-decimals)
            break
    for digits in range(1, _MOST_DIGITS + 1):
        if all(float(f"{value:.{digits}g}") == value for value in values):
            # Next to zero the line through the others is known less well than that.
            size = np.maximum(np.abs(values), _NEAR_ZERO * np.max(np.abs(values)))
            yield 10.0 ** (np.floor(np.log10(size)) + 1.0 - digits)
            break


def _step_between(values: np.ndarray, written: np.ndarray) -> float:
    gaps = np.diff(values)
    gaps = gaps[gaps > _APART * np.maximum(written[1:], written[:-1])]
    if len(gaps) < 2:
        return 0.0
    step, zero = float(gaps.min()), 0.0
    for _ in range(_REFINEMENTS):
        counts = np.round((values - values[0]) / step)
        if counts[-1] < 2.0:
            return 0.0
        step, zero = np.polyfit(counts, values, 1, w=1.0 / written)
    off = np.abs(values - zero - step * np.round((values - zero) / step))
    apart = step > _APART * written.max()
    return float(step) if apart and np.all(off <= written) else 0.0
