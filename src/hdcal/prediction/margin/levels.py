"""Force at each temperature, and the bounds of each model.

A reading lies within half a step of the force: bounds, capacities and the interval of
the share above the limit are for the worst place of the force in a step. In the
interval of one member and its probability of exceedance the rounding is a component.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.prediction.conditions import SENSE, is_tested
from hdcal.prediction.margin.exceedance import exceedance
from hdcal.prediction.margin.request import MarginRequest
from hdcal.prediction.margin.result import Level, ModelBound
from hdcal.prediction.members import Members, one_member, over_draws
from hdcal.prediction.models import Model
from hdcal.report.item import TAILS, Interval


def force_levels(
    found: Sequence[Model], asked: MarginRequest, members: Members, step: float
) -> tuple[Level, ...]:
    """Return the force at each temperature.

    Args:
        found: the models.
        asked: the request.
        members: of all models, one row for each temperature.
        step: of a reading, 0 for a load [N].
    """
    sign, half, weight = asked.direction_of_loading, 0.5 * step, members.weight
    low, high = _bounds(members, asked, half)
    needed = members.quantile(asked.required)
    least, capacity = over_draws(needed, weight, [0.5, asked.confidence]) + half
    mean = sign * over_draws(members.centre, weight, TAILS)
    one = one_member(members, step / 12.0**0.5)
    member = sign * np.stack([one.quantile(tail)[0] for tail in TAILS])
    tested = is_tested(
        found[0].posterior.case.records,
        deformation=asked.deformation,
        temperature=asked.temperature,
        sense=sign * SENSE[asked.direction],
    )
    above = None
    if asked.limit_force is not None:
        # At the least, with the rounding as a component, and at the most.
        rounded = replace(members, sd=np.hypot(members.sd, step / 12.0**0.5))
        above = np.stack(
            [
                members.above(asked.limit_force + half),
                rounded.above(asked.limit_force),
                members.above(asked.limit_force - half),
            ]
        )
    return tuple(
        Level(
            temperature_C=float(warm),
            tested=bool(tested[row]),
            force_N=_interval(mean[:, row]),
            member_N=_interval(member[:, row]),
            lower_bound_N=float(low[row]),
            upper_bound_N=float(high[row]),
            capacity_N=float(capacity[row]),
            capacity_median_N=float(least[row]),
            exceedance=None
            if above is None
            else exceedance(above[:, :, row], weight, found, asked.confidence),
        )
        for row, warm in enumerate(asked.temperature)
    )


def model_bounds(
    found: Sequence[Model], parts: Sequence[Members], asked: MarginRequest, step: float
) -> tuple[ModelBound, ...]:
    """Return the bounds of each of several models; of one none.

    Args:
        found: the models.
        parts: the members of each at one condition.
        asked: the request.
        step: of a reading, 0 for a load [N].
    """
    if len(found) == 1:
        return ()
    bounds = []
    for model, part in zip(found, parts, strict=True):
        low, high = _bounds(part, asked, 0.5 * step)[:, 0]
        bounds.append(
            ModelBound(
                model=model.name,
                probability=model.probability,
                lower_bound_N=float(low),
                upper_bound_N=float(high),
            )
        )
    return tuple(bounds)


def _bounds(members: Members, asked: MarginRequest, half: float) -> np.ndarray:
    """Return lower and upper bounds with the sign of the force [N], (2, row)."""
    shares = (
        (asked.content, asked.confidence),
        (1.0 - asked.content, 1.0 - asked.confidence),
    )
    high, low = (
        over_draws(members.quantile(content), members.weight, [confidence])[0]
        for content, confidence in shares
    )
    ends = np.stack([low - half, high + half])
    return np.sort(asked.direction_of_loading * ends, axis=0)


def _interval(quantiles: np.ndarray) -> Interval:
    low, median, high = map(float, quantiles)
    return Interval(median=median, lo=min(low, high), hi=max(low, high))
