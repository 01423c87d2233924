"""The probability that one set point of a spring keeps gears inside a window.

A spring of rate c presses on the gear from inside at each of two opposed places. Its
free end stands at x beyond the undeformed gear, so that in balance

    c (x − ω) = F(ω, T),

with force F and radial deformation ω of one side. F grows with ω; so does ω + F(ω)/c,
and ω ≥ lo exactly if x ≥ lo + F(lo)/c, ω ≤ hi exactly if x ≤ hi + F(hi)/c. A gear is
inside the window at all temperatures exactly if x lies in one interval, so that
every probability here is a count of intervals: no equation has to be solved.
"""

from typing import NamedTuple

import numpy as np

from hdcal.report.item import Item, Probability, quantity

# Number of rates, evenly spaced in their logarithm.
_RATES = 61
# Bisections between two of them: the rate is then known to 1 %.
_HALVINGS = 4


class SpringGap(NamedTuple):
    """A window and the gears that have to stay inside.

    Attributes:
        low, high: least and largest deformation [mm].
        force_low, force_high: of each gear there [N], (temperature, draw).
        error: by which x comes out too large [mm], (draw,).
        least: probability of what no draw shows.
    """

    low: float
    high: float
    force_low: np.ndarray
    force_high: np.ndarray
    error: np.ndarray
    least: float = 0.0


class Kept(Item):
    """Probabilities with one set point for every gear."""

    probability: Probability = quantity("probability inside the window")
    zero_backlash: Probability = quantity("probability of no backlash")
    no_jam: Probability = quantity("probability of no jam")


class Spring(Kept):
    """A spring rate c with its best set point x."""

    rate_N_per_mm: float = quantity("spring rate", "N/mm")
    interference_mm: float = quantity("set point", "mm")


def set_points(rate: float, gap: SpringGap) -> np.ndarray:
    """Return the ends of the x at which each gear stays inside [mm], (2, draw).

    There is none where the first end is larger.
    """
    low = gap.low + np.max(gap.force_low, axis=0) / rate
    high = gap.high + np.min(gap.force_high, axis=0) / rate
    return np.stack([low, high]) - gap.error


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


def kept_at(rate: float, x: float, gap: SpringGap) -> dict[str, float]:
    """Return the probabilities that a set point [mm] achieves at a rate [N/mm]."""
    low, high = set_points(rate, gap)
    above, below = x >= low, x <= high
    kept = {"probability": above & below, "zero_backlash": above, "no_jam": below}
    ends = gap.least, 1.0 - gap.least
    return {name: float(np.clip(np.mean(each), *ends)) for name, each in kept.items()}


def judge(rate: float, gap: SpringGap) -> Spring:
    """Return the best common set point at a rate [N/mm]."""
    x = best_common(*set_points(rate, gap))
    return Spring(rate_N_per_mm=rate, interference_mm=x, **kept_at(rate, x, gap))


def judge_all(
    rates: tuple[float, float], gap: SpringGap, required: float
) -> tuple[list[Spring], Spring | None]:
    """Return springs between two rates [N/mm], and the softest suitable one or None."""
    springs = [judge(float(rate), gap) for rate in np.geomspace(*rates, _RATES)]
    met = [row for row, one in enumerate(springs) if one.probability >= required]
    if not met:
        return springs, None
    chosen, below = springs[met[0]], springs[max(met[0] - 1, 0)].rate_N_per_mm
    for _ in range(_HALVINGS if met[0] else 0):
        middle = judge(float(np.sqrt(below * chosen.rate_N_per_mm)), gap)
        springs.append(middle)
        if middle.probability >= required:
            chosen = middle
        else:
            below = middle.rate_N_per_mm
    return sorted(springs, key=lambda one: one.rate_N_per_mm), chosen
