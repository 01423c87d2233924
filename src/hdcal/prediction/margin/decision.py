"""Decision whether a force keeps a limit (ISO/IEC 17025, JCGM 106:2012, ILAC-G8)."""

from typing import Literal

from hdcal.prediction.margin.request import Rule
from hdcal.report.item import Item, Probability, quantity


class Conformity(Item):
    """Decision on one member; limit and guard band are sizes along the loading.

    The probability of conformity is a lower limit where the draws do not resolve it;
    the risk of false acceptance is the specific one.
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
