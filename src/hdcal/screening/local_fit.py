"""Robust local lines through a record, and how unusual a departure from them is."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hdcal.screening.turning_points import MEDIAN_SIZE

# Rows on each side of the one that is looked at: a robust line through ten rows
# bears two or three wild ones.
REACH = 5
# Rows that are looked at in a long record: those with the largest steps, and others
# evenly spaced, which tell what is usual.
MOST_ROWS = 2000
# No rig resolves a smaller share of the tested range, and no departure below it
# changes a stiffness by more than some parts in ten thousand.
RESOLVED = 1e-4
_SOME = 4000  # so many values show the range and the last digit
# Share of the range that is no more than rounding of what was computed.
_ROUNDING = 1e-8
# Quotient of the 95 % and the 50 % quantile of |t|, by degrees of freedom.
_DOFS = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 8.0])
_TAILS = np.array([12.7, 5.27, 4.16, 3.75, 3.54, 3.26])
# From fewer values the tail of a distribution does not show; it counts as heavy.
_FEW = 40
_FEW_DOF = 3.0
# A fault is believed a priori in one of some hundred records: log of these odds.
_ODDS = 5.0


@dataclass(frozen=True)
class Usual:
    """What a statistic usually is in this record: Student's t about zero."""

    scale: float
    dof: float  # degrees of freedom; few where the tail is heavy

    @classmethod
    def of(cls, values: np.ndarray, least: float) -> "Usual":
        """Fit it to values, most of them usual; `least` is the smallest scale."""
        size = np.abs(values[np.isfinite(values)])
        if size.size < 2:
            return cls(np.inf, _FEW_DOF)
        middle, far = (quantile(size, share) for share in (0.5, 0.95))
        scale = max(float(middle) / MEDIAN_SIZE, least)
        if size.size < _FEW:
            return cls(scale, _FEW_DOF)
        tail = float(far) / max(float(middle), MEDIAN_SIZE * least)
        return cls(scale, float(np.interp(-tail, -_TAILS, _DOFS)))

    def surprised(self, values: np.ndarray, places: int) -> np.ndarray:
        """Tell which values a fault at one of many places explains better.

        By a likelihood ratio: a fault has a place and a size, each at the price that
        the Bayesian information criterion sets.
        """
        square = np.nan_to_num(values / self.scale) ** 2
        gain = 0.5 * (self.dof + 1.0) * np.log1p(square / self.dof)
        return gain > 1.5 * np.log(places) + _ODDS


def looked_at(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the rows at which a fault may be: all of them in a short record."""
    n = x.size
    if n <= MOST_ROWS:
        return np.arange(n)
    size = np.zeros(n)
    for values in (x, y):
        steps = np.abs(np.diff(values, prepend=values[0]))
        size = np.maximum(size, steps / max(spread(values), 1e-300))
    half = MOST_ROWS // 2
    largest = np.argpartition(size, n - half // 2)[n - half // 2 :]
    # the reading before a large step may be the wild one
    near = np.clip(np.r_[largest, largest - 1], 0, n - 1)
    return np.unique(np.r_[near, np.linspace(0, n - 1, half).astype(int)])


def spread(values: np.ndarray) -> float:
    """Return the range of the central nine tenths, as of an evenly filled range."""
    some = values[:: max(1, values.size // _SOME)]
    low, high = (quantile(some, share) for share in (0.05, 0.95))
    if high > low:
        return float(high - low) / 0.9
    return float(np.ptp(values))


def resolution(values: np.ndarray) -> float:
    """Return the smallest departure that counts: a digit, or a share of the range."""
    values = values[:: max(1, values.size // _SOME)]
    return max(RESOLVED * spread(values), least_step(values))


def least_step(values: np.ndarray) -> float:
    """Return the smallest difference of two values; 0 where all are the same."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * steps.sum()]
    return float(steps.min()) if steps.size else 0.0


def windows(values: np.ndarray, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the values at offsets from rows, NaN beyond the ends, shape (r, o)."""
    places = rows[:, None] + offsets
    inside = (places >= 0) & (places < values.size)
    return np.where(inside, values[np.clip(places, 0, values.size - 1)], np.nan)


def slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the slopes of all pairs in each window, NaN where x is the same."""
    first, second = np.array([*combinations(range(x.shape[1]), 2)]).T
    run, rise = x[:, second] - x[:, first], y[:, second] - y[:, first]
    return np.divide(rise, run, out=np.full(run.shape, np.nan), where=run != 0.0)


def quantile(values: np.ndarray, share: float, otherwise: float = np.nan) -> np.ndarray:
    """Return a quantile along the last axis, of the values that are there."""
    values = np.sort(values, axis=-1)  # NaN last
    count = np.sum(np.isfinite(values), axis=-1)
    place = share * np.maximum(count - 1, 0)
    low = place.astype(int)
    high = np.minimum(low + 1, np.maximum(count - 1, 0))
    first, second = (
        np.take_along_axis(values, each[..., None], -1)[..., 0] for each in (low, high)
    )
    return np.where(count > 0, first + (place - low) * (second - first), otherwise)


def median(values: np.ndarray, otherwise: float = np.nan) -> np.ndarray:
    """Return the median along the last axis, of the values that are there."""
    return quantile(values, 0.5, otherwise)


def residuals(x: np.ndarray, y: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return how far rows lie from a robust line through their neighbours.

    NaN with fewer than three neighbours on either side.
    """
    offsets = np.r_[-REACH:0, 1 : REACH + 1]
    near_x = windows(x, rows, offsets) - x[rows, None]
    near_y = windows(y, rows, offsets)
    slope = median(slopes(near_x, near_y), 0.0)
    found = y[rows] - median(near_y - slope[:, None] * near_x)
    edge = (rows < 3) | (rows > x.size - 4)
    return np.where(edge, np.nan, found)
