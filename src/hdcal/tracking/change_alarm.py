"""A change alarm with a known rate of false alarms: the two-sided CUSUM.

Standardised innovations are independent and standard normal while nothing changes.
Each sum S ← max(0, S ± z − k) raises the alarm above h, which follows from the wanted
mean number of rows between false alarms.
"""

import jax.numpy as jnp
import numpy as np
import scipy
from scipy.special import ndtr

# Half the shift, in noise sds, that the sums are quickest to find.
ALLOWANCE = 0.5
_NODES = 96


def run_length(threshold: float, shift: float = 0.0) -> float:
    """Return the mean number of rows until a one-sided CUSUM from zero passes h.

    Solves L(u) = 1 + L(0) Φ(k − u) + ∫₀ʰ L(v) φ(v + k − u) dv, with k the allowance
    less the shift (mean of the innovations), by Gauss-Legendre quadrature. For this
    smooth kernel that is exact to rounding (Page, Biometrika 41, 1954).
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    at = np.append(0.0, 0.5 * threshold * (nodes + 1.0))
    weight = np.append(0.0, 0.5 * threshold * weights)
    moved = ALLOWANCE - shift
    table = np.exp(-0.5 * (at[None, :] + moved - at[:, None]) ** 2)
    table *= weight / np.sqrt(2.0 * np.pi)
    table[:, 0] = ndtr(moved - at)
    return float(np.linalg.solve(np.eye(len(at)) - table, np.ones(len(at)))[0])


def threshold_for(rows: float) -> float:
    """Return h of a two-sided CUSUM with this mean number of rows to a false alarm.

    The rates of the two sides add (van Dobben de Bruyn, 1968).
    """

    def excess(h: float) -> float:
        return np.log(run_length(h)) - np.log(2.0 * rows)

    return float(scipy.optimize.root_scalar(excess, bracket=(0.01, 25.0)).root)


def step_sums(sums, innovation, threshold):
    """Take the next innovation; an alarm restarts the sums from zero.

    Returns:
        The sums, above and below zero; the larger one as a share of the threshold,
        negative if readings lie below what was expected; whether the alarm is raised.
    """
    sums = jnp.maximum(0.0, sums + jnp.array([1.0, -1.0]) * innovation - ALLOWANCE)
    larger = jnp.max(sums)
    alarm = larger > threshold
    score = jnp.where(sums[1] > sums[0], -larger, larger) / threshold
    return jnp.where(alarm, 0.0, sums), score, alarm
