"""Where a deformation sequence turns and where it rests, through reading noise."""

import numpy as np

# Shares of the run's range. A reversal smaller than the first is reading noise;
# noise may raise it to the second but no further, or cycles would be lost.
TURN_SHARE, TURN_MOST = 5e-3, 0.2
HOLD_SHARE, HOLD_MOST = 2.5e-3, 0.05

# Median absolute value of normal noise, in sds: Φ⁻¹(¾).
MEDIAN_SIZE = 0.6744897501960817
# Fewer rows were taken by hand: uneven steps would pass for noise.
FEWEST_FOR_NOISE = 50


def noise_sd(x: np.ndarray, fewest: int = FEWEST_FOR_NOISE) -> float:
    """Return a robust sd of the noise in a dense sequence; 0 for fewer rows."""
    if x.size < fewest:
        return 0.0
    # the sd of x[i-1] - 2 x[i] + x[i+1] is √6 times that of x
    return float(np.median(np.abs(np.diff(x, 2)))) / (MEDIAN_SIZE * 6**0.5)


def rows_of_runs(run: np.ndarray) -> list[np.ndarray]:
    """Return the rows of each run, given the index of each row's, shape (n,)."""
    order = np.argsort(run, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(run[order])) + 1)
    return parts if order.size else []


def turning_points(x: np.ndarray, threshold: float) -> tuple[np.ndarray, int]:
    """Return rows at which x reverses by a threshold, and the first sign, or 0."""
    # Only rows where the difference changes sign can be reversals, so the loop,
    # which has to be sequential, sees those alone.
    rows = np.flatnonzero(np.diff(x, prepend=np.nan) != 0)
    slope = np.sign(np.diff(x[rows]))
    kept = np.ones(rows.size, bool)
    kept[1:-1] = slope[1:] != slope[:-1]
    rows = rows[kept]
    found: list[int] = []
    sign = first = 0
    low = high = extreme = x[0]
    low_row = high_row = best = 0
    for row, value in zip(rows.tolist(), x[rows].tolist(), strict=True):
        if sign == 0:
            if value < low:
                low, low_row = value, row
            if value > high:
                high, high_row = value, row
            if high - low >= threshold:
                sign = first = 1 if high_row > low_row else -1
                extreme, best = (high, high_row) if sign > 0 else (low, low_row)
        elif (value - extreme) * sign > 0:
            extreme, best = value, row
        elif (extreme - value) * sign >= threshold:
            found.append(best)
            sign, extreme, best = -sign, value, row
    return np.array(found, int), first


def envelope(x: np.ndarray, sign: int) -> np.ndarray:
    """Return the monotone envelope of one movement, rising whatever the sign, (n,)."""
    return np.maximum.accumulate(x * sign)


def resting(rising: np.ndarray, tolerance: float) -> np.ndarray:
    """Tell at which rows of one movement the deformation is held, shape (n,).

    A level is a hold where four times the tolerance contains hardly more rows than the
    tolerance itself: on a ramp it contains four times as many, at the smooth top of a
    sine twice as many. `rising` is the monotone envelope.
    """
    near = _rows_within(rising, tolerance / 2)
    return (near >= 2) & (_rows_within(rising, 2 * tolerance) < 1.5 * near)


def _rows_within(rising: np.ndarray, reach: float) -> np.ndarray:
    # a hair more, so that a step of exactly the reach is inside on both sides
    reach *= 1 + 1e-9
    left = np.searchsorted(rising, rising - reach, "left")
    return np.searchsorted(rising, rising + reach, "right") - left
