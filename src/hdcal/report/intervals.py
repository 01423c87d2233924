"""Intervals of posterior quantities."""

from dataclasses import dataclass

import numpy as np

from hdcal.report.answer import Real

INTERVAL = 0.95


@dataclass(frozen=True)
class Interval:
    """An equal-tailed interval with its median; which probability, says its owner."""

    median: Real
    lo: Real
    hi: Real


def credible_interval(values: np.ndarray) -> Interval:
    """Return median and equal-tailed 95 % credible interval."""
    tail = (1.0 - INTERVAL) / 2.0
    lo, median, hi = np.quantile(values, [tail, 0.5, 1.0 - tail])
    return Interval(float(median), float(lo), float(hi))
