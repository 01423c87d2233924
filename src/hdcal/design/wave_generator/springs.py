"""The probability that one set point of a spring keeps gears inside a window.

A spring of rate c presses on the gear from inside at each of two opposed places. Its
free end stands at x beyond the undeformed gear, so that in balance

    c (x − ω) = F(ω, T),

with force F and radial deformation ω of one side. F grows with ω; so does ω + F(ω)/c,
and ω ≥ lo exactly if x ≥ lo + F(lo)/c, ω ≤ hi exactly if x ≤ hi + F(hi)/c. A gear is
inside the window at all temperatures exactly if x lies in one interval, so that
every probability here is a count of intervals: no equation has to be solved.
Deformations, forces and set points are along the sense of loading
(`hdcal.prediction.engine.loading_sense`): the balance of a pulled gear is the same.
"""

import numpy as np

from hdcal.report.item import Item, quantity

# Number of rates, evenly spaced in their logarithm.
_RATES = 61
# Bisections between two of them: the rate is then known to 1 %.
_HALVINGS = 4


class Spring(Item):
    """One spring rate, and what a common set point achieves with it.

    Attributes:
        rate: c.
        interference: x of the best common set point.
        together: probability that a gear is in the window at all temperatures.
        no_backlash: probability of ω ≥ lo at all temperatures.
        no_jam: probability of ω ≤ hi at all temperatures.
        adjusted: probability with x adjusted gear by gear, not by temperature.
    """

    rate: float = quantity("spring rate", "N/mm")
    interference: float = quantity("set point", "mm")
    together: float = quantity("probability inside the window")
    no_backlash: float = quantity("probability of no backlash")
    no_jam: float = quantity("probability of no jam")
    adjusted: float = quantity("probability inside the window, each gear adjusted")


def set_points(rate: float, window, forces: np.ndarray, error=0.0) -> np.ndarray:
    """Return the interval of x [mm] in which each gear stays in the window.

    Args:
        rate: c [N/mm].
        window: lo and hi [mm].
        forces: [deformation, temperature, draw], the window's ends first and last.
        error: by which x comes out too large [mm], shape (draw,).

    Returns:
        Ends of the interval, shape (2, draw); empty where the first is larger.
    """
    low = window[0] + np.max(forces[0], axis=0) / rate - error
    high = window[1] + np.min(forces[-1], axis=0) / rate - error
    return np.stack([low, high])


def best_common(low: np.ndarray, high: np.ndarray) -> float:
    """Return the point that lies in most of the intervals [low, high].

    If several stretches are equally good, it is the middle of the longest one.
    """
    full = low <= high
    starts, ends = np.sort(low[full]), np.sort(high[full])
    if not len(starts):
        return float(np.mean(0.5 * (low + high)))
    # Between two neighbouring ends the count is constant; starts come first in ties.
    edges = np.concatenate([starts, ends])
    change = np.concatenate([np.ones(len(starts)), -np.ones(len(ends))])
    order = np.lexsort((-change, edges))
    edges, count = edges[order], np.cumsum(change[order])
    most = np.flatnonzero(count[:-1] == count.max())
    widest = most[np.argmax(edges[most + 1] - edges[most])]
    return float(0.5 * (edges[widest] + edges[widest + 1]))


def judge(rate: float, window, forces, error) -> Spring:
    """Return the best common set point at one spring rate [N/mm]."""
    low, high = set_points(rate, window, forces, error)
    x = best_common(low, high)
    above, below = x >= low, x <= high
    return Spring(
        rate=float(rate),
        interference=x,
        together=float(np.mean(above & below)),
        no_backlash=float(np.mean(above)),
        no_jam=float(np.mean(below)),
        adjusted=_adjusted(rate, window, forces, error),
    )


def _adjusted(rate: float, window, forces, error) -> float:
    """Return the probability with a set point for each gear, in its own middle."""
    low, high = set_points(rate, window, forces)
    x = 0.5 * (low + high) + error
    return float(np.mean((x >= low) & (x <= high)))


def judge_all(rates: tuple[float, float], window, forces, error) -> list[Spring]:
    """Return springs of all rates between two [N/mm], softest first."""
    every = np.geomspace(rates[0], rates[1], _RATES)
    return [judge(rate, window, forces, error) for rate in every]


def softest(springs: list[Spring], window, forces, error, required) -> Spring | None:
    """Return the softest spring that meets a probability, or None.

    Args:
        springs: from `judge_all`; between two of them the rate is refined.
        window: lo and hi [mm].
        forces: as for `set_points`.
        error: of the set point [mm], shape (draw,).
        required: probability.
    """
    met = [spring.together >= required for spring in springs]
    if not any(met):
        return None
    first = met.index(True)
    if first == 0:
        return springs[0]
    below, above = springs[first - 1].rate, springs[first]
    for _ in range(_HALVINGS):
        middle = judge(np.sqrt(below * above.rate), window, forces, error)
        if middle.together >= required:
            above = middle
        else:
            below = middle.rate
    return above
