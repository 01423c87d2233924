"""Shares, medians and means with their intervals."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

RESAMPLES = 1000
# Everything random in a score starts here, so that scoring twice gives one answer.
SEED = 20


@dataclass(frozen=True)
class Estimate:
    """A number, its 95 % interval and the number of cases behind it.

    Attributes:
        value: None without cases.
        lo: lower end of the interval, None where there is none.
        hi: upper end.
        n: number of cases.
    """

    value: float | None
    lo: float | None
    hi: float | None
    n: int


def share(hits: Iterable[float | bool]) -> Estimate:
    """Return a share with Wilson's interval, which holds near 0 and 1 as well.

    Args:
        hits: one number from 0 to 1 per case; a tie of two counts ½.
    """
    counted = [float(hit) for hit in hits]
    n = len(counted)
    if not n:
        return Estimate(None, None, None, 0)
    p, z = math.fsum(counted) / n, float(norm.ppf(0.975))
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    # Rounding must not put the ends inside a share of exactly 0 or 1.
    low, high = max(min(middle - half, p), 0.0), min(max(middle + half, p), 1.0)
    return Estimate(p, low, high, n)


def median(values: Sequence[float]) -> Estimate:
    """Return a median with a bootstrap interval."""
    return _resampled(values, np.median)


def mean(values: Sequence[float]) -> Estimate:
    """Return a mean with a bootstrap interval."""
    return _resampled(values, np.mean)


def _resampled(values: Sequence[float], statistic: Callable) -> Estimate:
    found, n = np.asarray(values, dtype=float), len(values)
    if n < 2:  # one case tells nothing of the scatter
        return Estimate(float(found[0]) if n else None, None, None, n)
    drawn = np.random.default_rng(SEED).integers(n, size=(RESAMPLES, n))
    low, high = np.quantile(statistic(found[drawn], axis=1), [0.025, 0.975])
    return Estimate(float(statistic(found)), float(low), float(high), n)
