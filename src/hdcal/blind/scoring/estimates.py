"""Numbers with their intervals: shares, medians, means and differences."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

WILSON = "Wilson 95 %"
BOOTSTRAP = "bootstrap 95 %"
RESAMPLES = 1000
_LEVEL = 0.95
# Everything random in a score starts here, so that scoring twice gives one answer.
SEED = 20


@dataclass(frozen=True)
class Estimate:
    """A number, how sure it is and how many cases it rests on.

    Attributes:
        value: None without cases.
        lo: lower end of the interval, None where there is none.
        hi: upper end.
        n: number of cases.
        interval: what kind the interval is.
    """

    value: float | None
    lo: float | None
    hi: float | None
    n: int
    interval: str


@dataclass(frozen=True)
class OfEffect:
    """The effect that something is about; as the last base its field comes first."""

    effect: str


def share(hits: Iterable[float | bool]) -> Estimate:
    """Return a share with Wilson's interval, which holds near 0 and 1 as well.

    Args:
        hits: one number from 0 to 1 per case; a tie of two counts ½.
    """
    counted = [float(hit) for hit in hits]
    n = len(counted)
    if not n:
        return Estimate(None, None, None, 0, WILSON)
    p, z = math.fsum(counted) / n, float(ndtri(0.5 + _LEVEL / 2.0))
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    # Rounding must not put the ends inside a share of exactly 0 or 1.
    return Estimate(
        p, max(min(middle - half, p), 0.0), min(max(middle + half, p), 1.0), n, WILSON
    )


def median(values: Sequence[float]) -> Estimate:
    """Return a median with a bootstrap interval."""
    return _resampled(values, lambda block: np.median(block, axis=-1))


def mean(values: Sequence[float]) -> Estimate:
    """Return a mean with a bootstrap interval; of differences, a paired one."""
    return _resampled(values, lambda block: np.mean(block, axis=-1))


def _resampled(
    values: Sequence[float], statistic: Callable[[np.ndarray], np.ndarray]
) -> Estimate:
    found = np.asarray(values, dtype=float)
    n = len(found)
    if not n:
        return Estimate(None, None, None, 0, BOOTSTRAP)
    value = float(statistic(found))
    if n == 1:  # one case says nothing about the scatter of cases
        return Estimate(value, None, None, 1, BOOTSTRAP)
    rng = np.random.default_rng(SEED)
    repeats = statistic(found[rng.integers(n, size=(RESAMPLES, n))])
    tail = (1.0 - _LEVEL) / 2.0
    low, high = np.quantile(repeats, [tail, 1.0 - tail])
    return Estimate(value, float(low), float(high), n, BOOTSTRAP)
