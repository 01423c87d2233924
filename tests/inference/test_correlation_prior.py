"""What the shipped prior of the correlation does to the slope of a straight line.

Exactly, on a grid: slope, zero and log σ are flat, so that given the correlation the
slope is Student's t.
"""

import numpy as np
import pytest
from scipy import signal, stats

from hdcal.data.priors import rig_priors
from hdcal.inference.distributions import frozen
from hdcal.inference.serial_correlation import CORRELATION

RUNS = 4000


def covered(law, rows: int, true: float) -> float:
    """Return the share of made-up runs whose 95 % interval holds the slope.

    Args:
        law: prior of the correlation.
        rows: of a run.
        true: the correlation.
    """
    rng = np.random.default_rng(8)
    steps = rng.normal(size=(rows, RUNS)) * np.sqrt(1.0 - true**2)
    steps[0] /= np.sqrt(1.0 - true**2)
    force = signal.lfilter([1.0], [1.0, -true], steps, axis=0)
    line = np.stack([np.linspace(0.02, 0.54, rows), np.ones(rows)], axis=1)
    weight, below, free = [], [], rows - 2
    # Evenly in v of ρ = tanh² v, which is fine at both ends.
    for v in np.linspace(0.0, 4.5, 101)[1:]:
        rho = np.tanh(v) ** 2
        share = law.logpdf(rho) + np.log(np.tanh(v) / np.cosh(v) ** 2)

        def whitened(table, rho=rho):
            later = (table[1:] - rho * table[:-1]) / np.sqrt(1.0 - rho**2)
            return np.concatenate([table[:1], later])

        x, y = whitened(line), whitened(force)
        precision, along = x.T @ x, x.T @ y
        slope = np.linalg.solve(precision, along)
        squares = np.sum(y**2, axis=0) - np.sum(slope * along, axis=0)
        volume = (rows - 1) * np.log1p(-(rho**2)) + np.linalg.slogdet(precision)[1]
        weight.append(share - 0.5 * volume - 0.5 * free * np.log(squares))
        sd = np.sqrt(squares / free * np.linalg.inv(precision)[0, 0])
        below.append(stats.t(free).cdf(-slope[0] / sd))
    shares = np.exp(np.array(weight) - np.max(weight, axis=0))
    found = np.sum(shares * below, axis=0) / shares.sum(axis=0)
    return float(np.mean((found > 0.025) & (found < 0.975)))


@pytest.mark.parametrize(
    ("rows", "true", "least"),
    [(60, 0.3, 0.935), (60, 0.6, 0.93), (60, 0.8, 0.92), (6, 0.0, 0.97)],
)
def test_a_slope_is_covered_up_to_a_moderate_correlation(rows, true, least):
    # 4,000 runs know a share to 0.4 %.
    assert covered(frozen(rig_priors()[CORRELATION]), rows, true) > least


def test_what_is_warned_of_is_so():
    """Of much correlated readings intervals hold less than they promise."""
    shipped = frozen(rig_priors()[CORRELATION])
    assert 0.87 < covered(shipped, 60, 0.9) < 0.91
    assert 0.78 < covered(shipped, 12, 0.8) < 0.83


def test_a_prior_that_expects_too_little_is_told_by_the_same_count():
    assert covered(stats.beta(0.5, 8.0), 60, 0.6) < 0.90
    assert covered(stats.beta(0.5, 2.0), 60, 0.6) < 0.935
