"""Prior of the correlation of neighbouring readings, by rig and record."""

import math
from dataclasses import replace

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.prior import Prior
from hdcal.data.priors import rig_priors
from hdcal.screening.turning_points import TURN_MOST, turning_points

# Noise is what is faster than the loading: readings err alike over a fifth of a half
# cycle at most, so that each holds five independent stretches. Slower is a bend.
_FAST = 0.2
# How many neighbours that err alike a filter stands for, and what is believed of the
# correlation where it is hardly any.
_AS_GOOD_AS, _UNFILTERED = 20.0, (0.5, 1.5)
_NAME = "noise_correlation"


def with_correlation_prior(
    gear: Gear, deformation: np.ndarray, run: np.ndarray, time: np.ndarray | None
) -> Gear:
    """Return a gear with the prior of the correlation that rig and record allow.

    Args:
        gear: what its file states of the correlation stays.
        deformation: in the order it was taken [mm], shape (n,).
        run: index of the mounting, shape (n,).
        time: of the readings [s], shape (n,); None where it was not measured.
    """
    shipped, own = rig_priors()[_NAME], gear.scale_priors.get(_NAME)
    if own is None or own.source != shipped.source:
        return gear
    cutoff = gear.source.get("rig", {}).get("filter_Hz")
    if cutoff is not None and time is not None and np.any(np.diff(time) > 0.0):
        found = behind_filter(cutoff, time)
    else:
        rows = rows_of_half_cycle(deformation, run)
        numbers = (0.0, math.exp(-1.0 / (_FAST * rows)))
        found = Prior(shipped.family, numbers, shipped.unit, shipped.source)
    return replace(gear, scale_priors=gear.scale_priors | {_NAME: found})


def behind_filter(cutoff: float, time: np.ndarray) -> Prior:
    """Return the prior of neighbours' correlation behind a low-pass filter.

    White noise behind a filter of first order is correlated by e^(−2π f Δt). Where
    that is little nothing is known: what else there is may err alike for longer.

    Args:
        cutoff: f, of the filter [Hz].
        time: of the readings [s], shape (n,), not all equal.
    """
    steps = np.diff(time)
    typical = float(np.median(steps[steps > 0.0]))
    likely = math.exp(-2.0 * math.pi * cutoff * typical)
    (a, b), known = _UNFILTERED, _AS_GOOD_AS * likely
    numbers = (a + known * likely, b + known * (1.0 - likely))
    return Prior("beta", numbers, "1", "[rig] filter_Hz, at the typical step")


def rows_of_half_cycle(deformation: np.ndarray, run: np.ndarray) -> float:
    """Return the median number of rows between two turns of the loading.

    Args:
        deformation: in the order it was taken [mm], shape (n,).
        run: index of the mounting, shape (n,).
    """
    lengths: list[int] = []
    order = np.argsort(run, kind="stable")
    cuts = np.flatnonzero(np.diff(run[order])) + 1
    for own in np.split(deformation[order], cuts):
        span = float(np.ptp(own))
        turns = turning_points(own, TURN_MOST * span)[0] if span > 0.0 else ()
        lengths += np.diff([0, *turns, len(own)]).tolist()
    return float(np.median(lengths))
