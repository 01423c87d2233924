"""A change alarm whose false alarms are counted beforehand: the two-sided CUSUM.

Standardised innovations are independent and standard normal while nothing changes.
Each sum S ← max(0, S ± z − k) calls when it passes h; h follows from the wanted mean
number of rows between false alarms.
"""

from functools import cache

import numpy as np
import scipy
from scipy.special import ndtr

# Half the shift, in noise sds, that the sums are quickest to find.
ALLOWANCE = 0.5
_NODES = 96
_MOST_THRESHOLD = 60.0


def run_length(threshold: float, shift: float = 0.0, k: float = ALLOWANCE) -> float:
    """Return the mean number of rows until a one-sided CUSUM from zero passes h.

    Solves L(u) = 1 + L(0) Φ(k − u) + ∫₀ʰ L(v) φ(v + k − u) dv by Gauss and Legendre's
    rule, which for this smooth kernel is exact to rounding.

    Args:
        threshold: h [-].
        shift: mean of the innovations [-].
        k: allowance [-].

    Source:
        Page, Biometrika 41 (1954); the limit of Brook and Evans' Markov chain (1972).
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    at = np.append(0.0, 0.5 * threshold * (nodes + 1.0))
    weight = np.append(0.0, 0.5 * threshold * weights)
    moved = k - shift
    table = np.exp(-0.5 * (at[None, :] + moved - at[:, None]) ** 2)
    table *= weight / np.sqrt(2.0 * np.pi)
    table[:, 0] = ndtr(moved - at)
    return float(np.linalg.solve(np.eye(len(at)) - table, np.ones(len(at)))[0])


@cache
def threshold_for(rows: float) -> float:
    """Return h of a two-sided CUSUM with this many rows between false alarms.

    The rates of the two sides add: each has a mean run length of twice the rows
    (van Dobben de Bruyn, 1968).

    Args:
        rows: mean number until a false alarm, 10 to 10⁹.
    """

    def excess(h: float) -> float:
        return np.log(run_length(h)) - np.log(2.0 * rows)

    return float(
        scipy.optimize.root_scalar(excess, bracket=(0.01, _MOST_THRESHOLD)).root
    )


class ChangeAlarm:
    """The two sums of a CUSUM, restarted from zero after each alarm.

    Args:
        threshold: h [-], as from `threshold_for`.
    """

    def __init__(self, threshold: float):
        self.threshold = threshold
        self._above = self._below = 0.0

    def step(self, innovation: float) -> tuple[float, bool]:
        """Take the next standardised innovation.

        Returns:
            The larger sum as a share of the threshold, negative if that of readings
            below what was expected (with their sign), and whether it calls.
        """
        self._above = max(0.0, self._above + innovation - ALLOWANCE)
        self._below = max(0.0, self._below - innovation - ALLOWANCE)
        larger = max(self._above, self._below)
        score = larger / self.threshold
        alarm = larger > self.threshold
        if self._below > self._above:
            score = -score
        if alarm:
            self._above = self._below = 0.0
        return score, alarm
