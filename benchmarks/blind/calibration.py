"""Calibration of stated probabilities: is 70 % true seven times in ten?

Stated probabilities fall into at most ten bins of equal counts, twenty or more in each.
With n_b of n statements in a bin, mean statement m_b and share true h_b, the plug-in
error is the sum of n_b/n |h_b − m_b|. Scatter alone makes that positive, so it is
debiased as by Kumar, Liang and Ma (Verified uncertainty calibration, 2019): twice the
plug-in less its mean with the scatter of a calibrated diagnoser, sum p (1 − p) / n_b²,
added once more.

A temperature divides the log odds of explanations. `temperature` is to be read on a
learning set, as a factor on the temperature that the answers were made with: it divides
the log odds of explanations, a diagnosis those of hypotheses, of which several may be
one explanation. So the set is answered again with the new temperature, until it is 1
within its interval.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from benchmarks.blind.estimates import SEED, Estimate, share
from benchmarks.blind.scored_case import FLOOR

_MOST_BINS, _LEAST_IN_BIN, _REPEATS = 10, 20, 500
# Temperatures that are tried, in steps of 2 %.
_TEMPERATURES = np.exp(np.linspace(-1.4, 1.4, 141))


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


def temperature(answers: Sequence[tuple[Mapping[str, float], str]]) -> Estimate:
    """Return the temperature with the best mean log score, with a bootstrap interval.

    Args:
        answers: probabilities of explanations, and the true one.
    """
    n = len(answers)
    if not n:
        return Estimate(None, None, None, 0)
    scores = np.array([_log_scores(chances, truth) for chances, truth in answers])
    rng = np.random.default_rng(SEED)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=_REPEATS)
    best = _TEMPERATURES[np.argmax(counts @ scores, axis=1)]
    low, high = np.quantile(best, [0.025, 0.975])
    value = float(_TEMPERATURES[np.argmax(scores.sum(axis=0))])
    return Estimate(value, float(low), float(high), n)


def _log_scores(chances: Mapping[str, float], truth: str) -> np.ndarray:
    """Return the log probability of the truth at each temperature."""
    possible = {name: chance for name, chance in chances.items() if chance > 0.0}
    if truth not in possible:
        return np.full(len(_TEMPERATURES), np.log(FLOOR))
    logs = np.log([*possible.values()])[:, None] / _TEMPERATURES
    whole = np.logaddexp.reduce(logs)
    found = np.log(possible[truth]) / _TEMPERATURES - whole
    return np.maximum(found, np.log(FLOOR))
