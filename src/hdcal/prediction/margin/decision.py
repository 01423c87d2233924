"""The decision whether a force keeps a limit.

Rules as ISO/IEC 17025:2017, 7.8.6, ILAC-G8:09/2019 and JCGM 106:2012 have them.
"""

from collections.abc import Sequence

import numpy as np

from hdcal.prediction.budget.inputs import scatter_law
from hdcal.prediction.budget.risk import global_false_accept
from hdcal.prediction.engine.loading_sense import LoadingSense, ends_along
from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.engine.sizes import SIZES
from hdcal.prediction.margin.budget_words import (
    GEAR,
    component_label,
    decision_words,
    more_is_asked,
    rule_words,
)
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import Level
from hdcal.prediction.margin.stated import Decision, Rule, StatedUncertainty, Statement

# Probabilities at which the scatter between gears is taken.
_LEVELS = (np.arange(200) + 0.5) / 200


def decide(
    rule: Rule, limit: float, estimate: float, low: float, high: float
) -> tuple[Statement, float]:
    """Return statement and guard band of a rule.

    Args:
        rule: guarded accepts an estimate only if the whole coverage interval keeps the
            limit, and rejects it only if none of it does; simple looks at the estimate
            alone.
        limit: that must not be exceeded.
        estimate: y.
        low: lower end of the coverage interval.
        high: upper end.
    """
    least, most = (low, high) if rule == "guarded" else (estimate, estimate)
    statement: Statement = "undecided"
    if most <= limit:
        statement = "conforms"
    elif least > limit:
        statement = "does not conform"
    return statement, most - estimate


def decision(
    stated: StatedUncertainty,
    worst: Level,
    criteria: Criteria,
    unrounded: Criteria,
    sense: LoadingSense,
    forces: Sequence[PopulationForce],
) -> Decision | None:
    """Return the decision about a force; without a limit there is none.

    Args:
        stated: its estimate and uncertainty.
        worst: how probable it is that it exceeds the limit.
        criteria: with the limit, a size, and the rule.
        unrounded: the same about the force before it is rounded.
        sense: of loading.
        forces: of each cause; of gears there is a global risk too.
    """
    limit, risk = criteria.limit_force, worst.exceedance
    most_force = unrounded.limit_force
    if limit is None or most_force is None or risk is None:
        return None
    rule, estimate = criteria.rule or "guarded", sense * stated.estimate_N
    low, high = ends_along(stated.coverage_lo_N, stated.coverage_hi_N, sense)
    statement, guard = decide(rule, most_force, estimate, low, high)
    most = most_force - guard
    overall = None
    if forces[0].whose.population == "specimens" and stated.budget:
        each, rest = _production_and_measurement(stated, forces)
        overall = sum(
            share * global_false_accept(estimate, sd, rest, most_force, most)
            for share, sd in each
        )
    wrong = risk.probability
    words = decision_words(estimate, most_force, guard, statement, wrong, overall)
    if statement == "conforms" and worst.capacity_N > limit:
        words += more_is_asked(worst.capacity_N, criteria.required, criteria.confidence)
    return Decision(
        rule=rule,
        limit_N=limit,
        guard_band_N=guard,
        acceptance_limit_N=most,
        statement=statement,
        probability_of_conformity=1.0 - wrong,
        false_accept_risk=wrong,
        global_false_accept_risk=overall,
        rule_words=rule_words(rule, limit, guard, most_force),
        words=words,
    )


def _production_and_measurement(
    stated: StatedUncertainty, forces: Sequence[PopulationForce]
) -> tuple[list[tuple[float, float]], float]:
    """Return sds between gears, also by their sizes, and that of all else [N].

    How much gears differ is known from few of them: each sd comes with its probability.
    """
    squares = {line.component: line.contribution_N**2 for line in stated.budget}
    gears = squares.pop(component_label(GEAR), 0.0)
    sizes = sum(squares.pop(component_label(n), 0.0) for n in SIZES.values())
    each = []
    for cause in (force.cause for force in forces):
        spread = np.quantile(cause.values["specimen_sd"], _LEVELS)
        scale, _ = scatter_law(cause.values["specimen_sd"] ** 2)
        share = cause.probability / len(_LEVELS)
        ratio = spread / scale if scale > 0.0 else np.ones(len(_LEVELS))
        each += [(share, float(np.sqrt(gears * r**2 + sizes))) for r in ratio]
    return each, sum(squares.values()) ** 0.5
