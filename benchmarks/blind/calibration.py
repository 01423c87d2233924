"""Calibration of stated probabilities: is 70 % true seven times in ten?

Stated probabilities fall into at most ten bins of equal counts, twenty or more in each.
With n_b of n statements in a bin, mean statement m_b and share true h_b, the plug-in
error is the sum of n_b/n |h_b − m_b|. Scatter alone makes that positive, so it is
debiased as by Kumar, Liang and Ma (Verified uncertainty calibration, 2019): twice the
plug-in less its mean with the scatter of a calibrated diagnoser, sum p (1 − p) / n_b²,
added once more.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from benchmarks.blind.estimates import SEED, Estimate, share

_MOST_BINS, _LEAST_IN_BIN, _REPEATS = 10, 20, 500


@dataclass(frozen=True)
class Statements:
    """Stated probabilities and their outcomes.

    Attributes:
        case: index of the case, shape (n,).
        stated: probability, shape (n,).
        true: 0 or 1, shape (n,).
    """

    case: np.ndarray
    stated: np.ndarray
    true: np.ndarray


def statements(rows: Iterable[tuple[int, float, bool]]) -> Statements:
    """Return statements from rows of case, probability and outcome."""
    table = np.array(list(rows), dtype=float).reshape(-1, 3)
    return Statements(table[:, 0].astype(int), np.clip(table[:, 1], 0, 1), table[:, 2])


def bins(stated: np.ndarray) -> np.ndarray:
    """Return the bin of each statement."""
    count = int(np.clip(len(stated) // _LEAST_IN_BIN, 1, _MOST_BINS))
    inner = np.quantile(stated, np.arange(1, count) / count)
    return np.unique(np.searchsorted(inner, stated), return_inverse=True)[1]


def debiased_error(found: Statements, places: np.ndarray, weight: np.ndarray) -> float:
    """Return the calibration error of statements in bins, each of a weight."""

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(places, weight * values)

    count = total(np.ones_like(found.stated))
    filled = np.maximum(count, 1e-12)
    gap = np.abs(total(found.true - found.stated)) / filled
    sd = np.sqrt(total(found.stated * (1.0 - found.stated))) / filled
    # Mean of |gap + sd Z|, Z standard normal.
    ratio = gap / np.maximum(sd, 1e-12)
    again = sd * np.sqrt(2 / np.pi) * np.exp(-0.5 * ratio**2)
    again += gap * (1.0 - 2.0 * norm.cdf(-ratio))
    part = count / count.sum()
    return max(0.0, float(2.0 * part @ gap - part @ again))


def calibration_error(found: Statements) -> Estimate:
    """Return the debiased calibration error, with a bootstrap interval over cases."""
    cases, index = np.unique(found.case, return_inverse=True)
    n = len(cases)
    if not n:
        return Estimate(None, None, None, 0)
    places = bins(found.stated)
    value = debiased_error(found, places, np.ones(len(found.stated)))
    if n == 1:
        return Estimate(value, None, None, 1)
    rng = np.random.default_rng(SEED)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=_REPEATS)
    repeats = [debiased_error(found, places, weight[index]) for weight in counts]
    # Resampling scatters twice, which lifts the error; only its spread is used.
    low, high = np.quantile(repeats, [0.025, 0.975]) - np.mean(repeats)
    return Estimate(value, max(value + min(low, 0.0), 0.0), value + max(high, 0.0), n)


def reliability(found: Statements) -> list[tuple[float, Estimate]]:
    """Return the mean stated probability of each bin, and the share that was true."""
    if not len(found.stated):
        return []
    places = bins(found.stated)
    return [
        (float(found.stated[places == b].mean()), share(found.true[places == b]))
        for b in range(places.max() + 1)
    ]
