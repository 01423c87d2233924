"""Force at each temperature with its bounds, exceedance of a limit and decision.

A reading lies within half a step of the force: bounds, capacities and the interval of
the share above the limit are for the worst place of the force in a step. In the
interval of one member and its probability of exceedance the rounding is a component.
"""

from typing import Literal

import numpy as np
from scipy.special import ndtri

from hdcal.prediction.conditions import RAREST, SENSE, is_tested
from hdcal.prediction.joint import JointModel
from hdcal.prediction.margin.request import MarginRequest, Rule
from hdcal.prediction.members import Members, one_member, over_draws
from hdcal.report.item import TAILS, Interval, Item, Probability, quantity

# Largest relative Monte Carlo error of a probability that is a number. Of an event that
# n independent draws do not show, the probability is below 3/n with 95 % confidence.
_ROUGH, _UNSEEN = 0.3, 3.0


class Exceedance(Item):
    """How probable it is that a member needs more than the capacity.

    Where the draws do not resolve the probability, it is an upper limit with 95 %
    confidence, and the reliability index −Φ⁻¹(P) a lower one.
    """

    probability: Probability = quantity("probability that a member exceeds the limit")
    error: float = quantity("Monte Carlo standard error of the probability")
    resolved: bool = quantity("whether the draws resolve the probability")
    lo: Probability = quantity("share of members above the limit, lower end")
    hi: Probability = quantity("share of members above the limit, upper end")
    at_confidence: Probability = quantity("share of members above, confidence bound")
    beta: float = quantity("reliability index")


class Level(Item):
    """The force at one temperature; capacities are sizes along the loading.

    The mean of the population has its 95 % credible interval, one future member its
    95 % predictive interval.
    """

    temperature_C: float = quantity("temperature", "°C")
    tested: bool = quantity("tested")
    force_N: Interval = quantity("mean", "N")
    member_N: Interval = quantity("one member", "N")
    lower_bound_N: float = quantity("lower bound", "N")
    upper_bound_N: float = quantity("upper bound", "N")
    capacity_N: float = quantity("required capacity", "N")
    capacity_median_N: float = quantity("required capacity, 50 % confidence", "N")
    exceedance: Exceedance | None = quantity("limit exceeded")


def force_levels(
    model: JointModel, asked: MarginRequest, members: Members, step: float
) -> tuple[Level, ...]:
    """Return the force at each temperature.

    The members have one row for each temperature; the step of a reading [N] is 0 for a
    load.
    """
    sign, half, sure = asked.loading_sense, 0.5 * step, asked.confidence
    most, least = (members.quantile(p) for p in (asked.content, 1.0 - asked.content))
    median, capacity = over_draws(most, [0.5, sure]) + half
    ends = [over_draws(least, 1.0 - sure) - half, capacity]
    low, high = np.sort(sign * np.stack(ends), axis=0)
    mean = np.sort(sign * over_draws(members.centre, TAILS), axis=0)
    member = one_member(members, step / 12.0**0.5)
    ends_of_member = [sign * member.quantile(tail)[0] for tail in TAILS][::sign]
    tested = is_tested(
        model.posterior.case.records,
        deformation=asked.deformation_mm,
        temperature=asked.temperatures_C,
        sense=sign * SENSE[asked.direction],
    )
    above = [None] * len(low)
    if asked.limit_force_N is not None:
        above = _exceedances(model, asked, members, step)
    return tuple(
        Level(
            temperature_C=float(warm),
            tested=bool(tested[row]),
            force_N=_interval(mean[:, row]),
            member_N=_interval([end[row] for end in ends_of_member]),
            lower_bound_N=float(low[row]),
            upper_bound_N=float(high[row]),
            capacity_N=float(capacity[row]),
            capacity_median_N=float(median[row]),
            exceedance=above[row],
        )
        for row, warm in enumerate(asked.temperatures_C)
    )


def _interval(ends) -> Interval:
    lo, median, hi = map(float, ends)
    return Interval(median=median, lo=lo, hi=hi)


def _exceedances(
    model: JointModel, asked: MarginRequest, members: Members, step: float
) -> list[Exceedance]:
    """Return the probability of exceedance at each temperature."""
    limit, half = asked.limit_force_N or 0.0, 0.5 * step
    wide = np.hypot(members.sd, step / 12.0**0.5)
    # At the least, with the rounding as a component, and at the most.
    least = members.above(limit + half)
    usual = Members(members.share, members.mean, wide).above(limit)
    most = members.above(limit - half)
    low = over_draws(least, TAILS[0])
    high, sure = over_draws(most, [TAILS[2], asked.confidence])
    exceedances = []
    for row, mean in enumerate(usual.mean(axis=0)):
        error = float(usual[:, row].std() / model.independent_draws**0.5)
        # Without scatter no draw may lie above the limit: no probability of zero.
        rough = error > _ROUGH * mean or mean == 0.0
        resolved = bool(not rough and mean >= RAREST)
        if rough:
            mean = mean + _UNSEEN / model.independent_draws
        mean = float(np.clip(mean, RAREST, 1.0))
        exceedances.append(
            Exceedance(
                probability=mean,
                error=error,
                resolved=resolved,
                lo=float(low[row]),
                hi=float(high[row]),
                at_confidence=float(sure[row]),
                beta=float(-ndtri(min(mean, 1.0 - 1e-16))),
            )
        )
    return exceedances


class Conformity(Item):
    """Decision on one member; limit and guard band are sizes along the loading.

    The probability of conformity is a lower limit where the draws do not resolve it;
    the risk of false acceptance is the specific one (ISO/IEC 17025, JCGM 106, ILAC-G8).
    """

    rule: Rule
    limit_N: float = quantity("limit", "N")
    guard_band_N: float = quantity("guard band", "N")
    acceptance_limit_N: float = quantity("acceptance limit", "N")
    statement: Literal["conforms", "does not conform", "undecided"]
    probability_of_conformity: Probability
    false_accept_risk: Probability


def decide(
    rule: Rule, limit: float, estimate: float, low: float, high: float, risk: float
) -> Conformity:
    """Return the decision; all numbers are sizes along the loading [N].

    Guarded accepts an estimate if the whole coverage interval keeps the limit, and
    rejects it if none of the interval does; simple compares the estimate alone. The
    risk is the probability that one member exceeds the limit.
    """
    least, most = (low, high) if rule == "guarded" else (estimate, estimate)
    rejected = "does not conform" if least > limit else "undecided"
    guard = most - estimate
    return Conformity(
        rule=rule,
        limit_N=limit,
        guard_band_N=guard,
        acceptance_limit_N=limit - guard,
        statement="conforms" if most <= limit else rejected,
        probability_of_conformity=1.0 - risk,
        false_accept_risk=risk,
    )
