"""What the correlation of neighbouring readings does to the interval of a slope.

Exactly, on a grid: slope, zero and log σ are flat, so that given the correlation the
slope is Student's t. The correlation is in the model from an evidence of 3 : 1 on.
"""

import numpy as np
import pytest
from scipy import signal, stats
from scipy.special import logsumexp

from hdcal.data.gear_file.rig_facts import rows_of_half_cycle

RUNS = 4000
pytestmark = pytest.mark.thorough


def covered(rows: int, true: float, least: float = 3.0) -> float:
    """Return the share of simulated ramps whose 95 % interval holds the slope.

    Args:
        rows: of a ramp.
        true: the correlation.
        least: evidence from which on the correlation is in the model.
    """
    rng = np.random.default_rng(8)
    steps = rng.normal(size=(rows, RUNS)) * np.sqrt(1.0 - true**2)
    steps[0] /= np.sqrt(1.0 - true**2)
    force = signal.lfilter([1.0], [1.0, -true], steps, axis=0)
    place = np.linspace(0.02, 0.54, rows)
    line = np.stack([place, np.ones(rows)], axis=1)
    most = np.exp(-5.0 / rows_of_half_cycle(place, np.zeros(rows, int)))
    weight, below, free = [], [], rows - 2
    for rho in [0.0, *most * (np.arange(100) + 0.5) / 100]:

        def whitened(table, rho=rho):
            later = (table[1:] - rho * table[:-1]) / np.sqrt(1.0 - rho**2)
            return np.concatenate([table[:1], later])

        x, y = whitened(line), whitened(force)
        precision, along = x.T @ x, x.T @ y
        slope = np.linalg.solve(precision, along)
        squares = np.sum(y**2, axis=0) - np.sum(slope * along, axis=0)
        volume = (rows - 1) * np.log1p(-(rho**2)) + np.linalg.slogdet(precision)[1]
        weight.append(-0.5 * volume - 0.5 * free * np.log(squares))
        sd = np.sqrt(squares / free * np.linalg.inv(precision)[0, 0])
        below.append(stats.t(free).cdf(-slope[0] / sd))
    independent, alike = weight[0], np.array(weight[1:])
    seen = logsumexp(alike, axis=0) - np.log(len(alike)) - independent > np.log(least)
    shares = np.exp(alike - np.max(alike, axis=0))
    found = np.sum(shares * below[1:], axis=0) / shares.sum(axis=0)
    found = np.where(seen, found, below[0])
    return float(np.mean((found > 0.025) & (found < 0.975)))


@pytest.mark.parametrize("rows", [15, 60, 400])
def test_independent_readings_have_the_interval_of_least_squares(rows):
    # 4,000 runs know a share to 0.4 %.
    assert covered(rows, 0.0) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(("rows", "true"), [(60, 0.5), (60, 0.7), (400, 0.9)])
def test_the_interval_allows_for_a_correlation_that_shows(rows, true):
    assert covered(rows, true) == pytest.approx(0.95, abs=0.02)
    # By least squares it does not.
    assert covered(rows, true, least=np.inf) < 0.8


def test_what_is_warned_of_is_so():
    """Of few, much correlated readings intervals hold less than they promise."""
    assert 0.83 < covered(60, 0.9) < 0.88
    assert 0.80 < covered(15, 0.5) < 0.86
