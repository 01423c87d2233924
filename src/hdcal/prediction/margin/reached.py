"""Inverse of the margin: the deformation that a given force reaches."""

from collections.abc import Sequence

import numpy as np

from hdcal.prediction.conditions import NEAR_MM, Conditions
from hdcal.prediction.joint import join
from hdcal.prediction.margin.request import MarginRequest
from hdcal.prediction.members import over_draws
from hdcal.prediction.models import Model
from hdcal.prediction.simulate import simulate
from hdcal.report.item import TAILS, Item
from hdcal.report.item import quantity as labelled

# Searched up to this multiple of the tested deformation, at so many places, in so many
# draws; between places the force is interpolated.
_REACH, _PLACES, _DRAWS = 2.0, 65, 1000
# A deformation of this size is none [mm].
_NONE = 1e6


class Reached(Item):
    """The deformation that a force reaches; None where it is not reached in the range.

    Median and 95 % credible interval are of the mean member; it is tested where the
    data hold all of its numbers.
    """

    force_N: float = labelled("given force", "N")
    temperature_C: float = labelled("temperature", "°C")
    searched_mm: tuple[float, float]
    median_mm: float | None = labelled("deformation reached", "mm")
    lo_mm: float | None = labelled("lower end", "mm")
    hi_mm: float | None = labelled("upper end", "mm")
    lower_bound_mm: float | None = labelled("lower bound", "mm")
    upper_bound_mm: float | None = labelled("upper bound", "mm")
    tested: bool


def deformation_reached(
    models: Sequence[Model],
    asked: MarginRequest,
    at: Conditions,
    warm: float,
    step: float,
) -> Reached | None:
    """Return the deformation at which the members first need the given force, if any.

    The share of the members that gets beyond a deformation is the share that needs less
    there. A member reaches the first deformation at which it needs the force.
    """
    force, model = asked.given_force_N, join(models, _DRAWS)
    if force is None:
        return None
    sign = 1 if force > 0.0 else -1
    read = sign * model.posterior.case.records.deformation
    low, high = float(read.min()), float(read.max())
    places = np.linspace(min(0.0, low), max(0.0, _REACH * high), _PLACES)
    unloading = bool(at.unloading[0])
    there = Conditions.of(
        sign * places,
        warm,
        sign,
        unloading,
        quantity=at.quantity,
        tolerances=at.tolerances,
    )
    members = simulate(model, there, asked.population, seed=asked.seed)
    half, size, sure = 0.5 * step, abs(force), asked.confidence

    def first(curve: np.ndarray, needed: float, shares: Sequence[float]):
        place = first_crossing(curve, needed, places)
        ends = np.clip(place, -1e3 * _NONE, 1e3 * _NONE)
        quantiles = over_draws(ends[:, None], shares)[:, 0]
        return [sign * float(x) if abs(x) < _NONE else None for x in quantiles]

    lower, upper = (members.quantile(p) for p in (1.0 - asked.content, asked.content))
    ends = first(upper, size - half, [1.0 - sure]) + first(lower, size + half, [sure])
    lo, median, hi = first(members.centre, size, TAILS)[::sign]
    least, most = ends[::sign]
    numbers = (lo, median, hi, least, most)
    return Reached(
        force_N=force,
        temperature_C=warm,
        searched_mm=(min(sign * places[[0, -1]]), max(sign * places[[0, -1]])),
        median_mm=median,
        lo_mm=lo,
        hi_mm=hi,
        lower_bound_mm=least,
        upper_bound_mm=most,
        tested=all(
            x is not None and low - NEAR_MM <= sign * x <= high + NEAR_MM
            for x in numbers
        ),
    )


def first_crossing(curve: np.ndarray, needed: float, places: np.ndarray) -> np.ndarray:
    """Return where each curve (draw, place) first reaches a value, by interpolation.

    Infinite where it is never reached, -infinite where the first place is beyond it.
    """
    passed = curve >= needed
    after = np.maximum(np.argmax(passed, axis=1), 1)
    rows = np.arange(len(curve))
    low, high = curve[rows, after - 1], curve[rows, after]
    share = np.clip((needed - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    crossing = places[after - 1] + share * (places[after] - places[after - 1])
    crossing = np.where(passed.any(axis=1), crossing, np.inf)
    return np.where(passed[:, 0], -np.inf, crossing)
