"""The threshold of the change alarm where the past is forgotten.

A tracker that forgets follows what it should call on: its innovations sum up to next
to nothing, and the threshold of independent ones is hardly ever passed. The rate of
false alarms is then simulated on many streams without a change.
"""

import numpy as np
import scipy

from hdcal.tracking.change_alarm import ALLOWANCE, threshold_for
from hdcal.tracking.linear_core import LinearCore
from hdcal.tracking.normal_inverse_gamma import NormalInverseGamma, normal_score

_STREAMS, _ROWS, _LEVELS = 500, 3000, 16
# Rows before those that count, in memories of the tracker.
_MEMORIES = 6.0
# Fewer false alarms than this say nothing of their rate.
_FEWEST = 20
# Scores are interpolated between so many places of the Student law, in scales.
_FARTHEST, _TABLE = 20.0, 801
# With a longer memory [rows] the alarm is quicker than the tracker.
_LONG = 2000.0


def forgetting_threshold(
    law: NormalInverseGamma,
    forget: float,
    design: np.ndarray,
    rows: float,
    correlation: float = 0.0,
) -> float:
    """Return h of the two-sided CUSUM of a tracker that forgets.

    Simulated up to about 70 000 rows between false alarms; beyond, the logarithm of
    the rows is continued as a quadratic function of h, which holds for independent
    scores (linear) and for a score of constant variance (quadratic) alike.

    Args:
        law: what the tracker begins with.
        forget: share of the past kept at each row, below 1.
        design: columns of rows such as will come, shape (n, p).
        rows: mean number between false alarms.
        correlation: ρ that is taken out of the rows.
    """
    usual = threshold_for(rows)
    if 1.0 / (1.0 - forget) > _LONG:
        return usual
    rng = np.random.default_rng(0)
    levels = np.linspace(0.15, 1.0, _LEVELS) * threshold_for(1e6)
    scores = simulate_scores(law, forget, design, rng, correlation)
    called = count_alarms(scores, levels)
    use = called >= _FEWEST
    level, weight = levels[use], np.sqrt(called[use])
    target = np.log(scores.size / called[use])
    # Growing, and bent upwards if at all.
    terms = np.stack([-np.ones_like(level), np.ones_like(level), level, level**2], 1)
    below, above, linear, bent = scipy.optimize.nnls(
        terms * weight[:, None], target * weight
    )[0]

    def excess(h: float) -> float:
        return above - below + (linear + bent * h) * h - np.log(rows)

    if excess(0.0) > 0.0:
        return float(levels[0])
    found = scipy.optimize.root_scalar(excess, bracket=(0.0, 10.0 * usual)).root
    return float(min(found, usual))


def settling_rows(forget: float) -> int:
    """Return after how many rows a tracker that forgets has settled.

    Until then it follows its beginning, and the threshold is the usual one.

    Args:
        forget: share of the past kept at each row, below 1.
    """
    return int(_MEMORIES / (1.0 - forget))


def simulate_scores(
    law: NormalInverseGamma,
    forget: float,
    design: np.ndarray,
    rng,
    correlation: float = 0.0,
) -> np.ndarray:
    """Return innovations of streams without a change, shape (row, stream).

    The streams share their columns, and so the gains of their cores; coefficients and
    noise of each are drawn from what the tracker begins with.

    Args:
        law: what the tracker begins with.
        forget: share of the past kept at each row.
        design: columns that rows are drawn from, shape (n, p).
        rng: source of randomness.
        correlation: ρ that is taken out of the rows.
    """
    core = LinearCore(law, forget)
    sd = (law.rate / rng.gamma(law.shape, size=_STREAMS)) ** 0.5
    wide = law.root @ rng.standard_normal((law.root.shape[1], _STREAMS))
    truth = law.mean + (sd * wide).T
    core.mean = np.tile(law.mean, (_STREAMS, 1))
    core.rate = np.full(_STREAMS, law.rate)
    settling = settling_rows(forget)
    rows = design[rng.integers(0, len(design), settling + _ROWS + 1)]
    rows = (rows[1:] - correlation * rows[:-1]) / (1.0 - correlation**2) ** 0.5
    kept, freedom = [], 0.0
    for columns in rows:
        core.fade()
        force = truth @ columns + sd * rng.standard_normal(_STREAMS)
        expected, scale, freedom = core.learn(columns, force)
        kept.append((force - expected) / scale)
    # Once it has settled a core that forgets keeps its degrees of freedom.
    t = np.linspace(-_FARTHEST, _FARTHEST, _TABLE)
    table = [normal_score(each, freedom) for each in t]
    return np.interp(kept[settling:], t, table)


def count_alarms(scores: np.ndarray, thresholds: np.ndarray) -> np.ndarray:
    """Return how often a two-sided CUSUM calls with each threshold.

    Args:
        scores: innovations, shape (row, stream).
        thresholds: h, shape (level,).
    """
    above = np.zeros((scores.shape[1], len(thresholds)))
    below, called = np.zeros_like(above), np.zeros(len(thresholds))
    for score in scores[:, :, None]:
        above = np.maximum(above + score - ALLOWANCE, 0.0)
        below = np.maximum(below - score - ALLOWANCE, 0.0)
        alarm = np.maximum(above, below) > thresholds
        called += np.count_nonzero(alarm, axis=0)
        above[alarm] = below[alarm] = 0.0
    return called
