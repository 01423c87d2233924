"""The budget and the decision in words."""

import numpy as np

from hdcal.prediction.budget.linear import LinearCheck, coverage_factor
from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.margin.budget import Component
from hdcal.prediction.margin.number_words import chance, newtons, newtons_down
from hdcal.prediction.margin.sentences import input_label
from hdcal.prediction.margin.stated import (
    BudgetCheck,
    Rule,
    StatedUncertainty,
    Statement,
)
from hdcal.report.words import number

GEAR = "gear"
_LABELS = {
    "resolution": "resolution of the {load} reading",
    "force_offset": "zero of the {load} gauge",
    "force_gain": "load cell, certificate",
    "deformation_gain": "displacement gauge, certificate",
    "temperature_offset": "thermometer, certificate",
}
# Unit for people, and its factor from the code's.
_UNITS = {
    "alpha": ("1/K", 1.0),
    "force_gain": ("%", 100.0),
    "deformation_gain": ("%", 100.0),
    "temperature_offset": ("K", 1.0),
    GEAR: ("%", 100.0),
    "zero_drift": ("{N}/K", 1.0),
    "frame": ("{mm}/K", 1.0),
    **dict.fromkeys(("wall_thickness", "radius", "length", "load_height"), ("mm", 1.0)),
}
_REMEDIES = {
    "noise": "the mean of 4 readings, independent of each other",
    "alpha": "readings at a second temperature",
    "cause": "the run that a diagnosis proposes next",
}
_CERTIFIED = {
    "force_gain": "a load cell certified to ± {:.2g} % (k = 2)",
    "deformation_gain": "a displacement gauge certified to ± {:.2g} % (k = 2)",
    "temperature_offset": "a thermometer certified to ± {:.2g} K (k = 2)",
}
_MOST_MEMBERS = 100


def component_label(name: str) -> str:
    """Return what a component of the budget is called."""
    return _LABELS.get(name, input_label(name))


def shown_unit(name: str) -> tuple[str, float]:
    """Return the unit in which people read a component, and the factor to it."""
    return _UNITS.get(name, ("{N}", 1.0))


def halved_by(part: Component, force: PopulationForce) -> str:
    """Return what would halve the contribution of a component."""
    name, problem, where = part.name, force.cause.problem, force.conditions
    if name in _REMEDIES:
        return _REMEDIES[name]
    if name in _CERTIFIED:
        # Half of U = 2u is u.
        return _CERTIFIED[name].format(shown_unit(name)[1] * part.standard_uncertainty)
    if name in force.tolerances:
        return f"a tolerance of ± {0.5 * force.tolerances[name]:.3g} mm"
    if name in ("mounting", GEAR):
        count = {"mounting": problem.runs, GEAR: problem.specimens}[name]
        return _more_members(count, f"{name}s")
    if name == "resolution":
        return f"a display in steps of {0.5 * float(problem.step):.3g} {{N}}"
    if name == "force_offset":
        half = 0.5 * part.standard_uncertainty
        return f"its zero out of contact, known to {half:.2g} {{N}} (sd)"
    if name == "leftover":
        return f"readings at {float(where.deformation):g} {{mm}}"
    if name in ("zero_drift", "frame"):
        return f"readings at {float(where.temperature):g} °C"
    rows = len(force.cause.posterior.case.records.force)
    return f"about {4 * rows} such readings instead of {rows}"


def _more_members(count: int, what: str) -> str:
    """Return how many tested members halve the interval of a new one, if any do.

    By Student's t; their own scatter stays however many are tested.
    """

    def width(size: int) -> float:
        return coverage_factor(size - 1.0) * np.sqrt(1.0 + 1.0 / size)

    for size in range(count + 1, _MOST_MEMBERS):
        if width(size) <= 0.5 * width(count):
            return f"{size} {what} instead of {count}"
    return f"half the scatter between {what}; to test more of them does not halve it"


def check_words(about, drawn, check: LinearCheck, error: float) -> str:
    """Return how the linear interval compares with that of Monte Carlo.

    Args:
        about: ends of the linear interval [N].
        drawn: of that of Monte Carlo.
        check: how far they differ, and may.
        error: standard error of the ends by Monte Carlo [N].
    """
    ends = [" … ".join(newtons(end) for end in pair) for pair in (about, drawn)]
    off = max(check.low, check.high)
    near = (
        f"The linear budget gives {ends[0]}, Monte Carlo {ends[1]} (95 %): the ends "
        f"differ by up to {off:.2g} {{N}}, where two digits of the standard "
        f"uncertainty allow {check.tolerance:.2g} {{N}} (JCGM 101, clause 8)"
    )
    if check.valid:
        return f"{near}. The linear budget stands."
    shift = abs(sum(about) - sum(drawn)) / 2.0
    spread = abs((about[1] - about[0]) - (drawn[1] - drawn[0])) / 2.0
    if off <= check.tolerance + 2.0 * error:
        why = f"the draws are too few to tell, an end is known to {error:.2g} "
        why += "{N} (sd)"
    elif shift > spread:
        why = "the {load} is no straight line of its inputs, or their laws are skewed"
    else:
        why = "the tails are not those of Student's t"
    return f"{near}. It is not confirmed, and Monte Carlo is given: {why}."


def coverage_words(check: BudgetCheck) -> str:
    """Return the coverage factor of the linear budget, and what it rests on."""
    dof = check.degrees_of_freedom
    # Beyond a thousand the two differ by less than is printed.
    law = f"Student t, {dof:.3g} d.o.f." if dof < 1000.0 else "normal"
    return f"k = {check.coverage_factor:.2f}, {law}"


def rule_words(rule: Rule, limit: float, guard: float, most: float) -> str:
    """Return a decision rule in words, as a certificate has to state it.

    Args:
        rule: guarded or simple.
        limit: of what is asked for [N].
        guard: guard band [N].
        most: the force up to which no reading exceeds the limit [N].
    """
    source = "ISO/IEC 17025, 7.8.6; ILAC-G8; JCGM 106"
    steps = ""
    if most != limit:
        steps = (
            f" No reading exceeds the limit of {limit:g} {{N}} up to a {{load}} "
            f"of {most:g} {{N}}, with which the {{load}} before rounding is compared."
        )
    if rule == "simple":
        return (
            f"Simple acceptance ({source}): the {{load}} conforms if its estimate is "
            f"at most the limit, {most:g} {{N}}, and does not conform otherwise. The "
            "uncertainty is not taken into account: an estimate at the limit is "
            f"accepted with a risk of about 50 %.{steps}"
        )
    return (
        f"Guarded acceptance ({source}): the {{load}} conforms if its estimate and the "
        f"guard band w together are at most the limit, {most:g} {{N}}; w = {guard:.3g} "
        f"{{N}} is what the 95 % coverage interval reaches beyond the estimate on the "
        "side of the limit. It does not conform if that whole interval lies beyond "
        "the limit. Between the two nothing is decided. An estimate at the acceptance "
        f"limit is accepted with a risk of 2.5 %.{steps}"
    )


def decision_words(
    estimate: float,
    limit: float,
    guard: float,
    statement: Statement,
    risk: float,
    overall: float | None,
) -> str:
    """Return a decision in words; all forces are along the sense of loading."""
    than = f"the limit {limit:g} {{N}}"
    if guard > 0.0:
        # No estimate above the limit may seem to lie below it.
        than = f"the acceptance limit {newtons_down(limit - guard)} = {limit:g} "
        than += "{N} − w"
    side = "at most" if statement == "conforms" else "above"
    if statement == "does not conform" and guard > 0.0:
        than = f"the limit {limit:g} {{N}} by more than its uncertainty"
    accepted = "" if statement == "conforms" else ", if it were accepted,"
    words = (
        f"{statement.capitalize()}: the estimate {newtons(estimate)} is {side} {than}. "
        f"Probability of conformity {chance(1.0 - risk)}, risk of a false acceptance"
        f"{accepted} {chance(risk)}."
    )
    if overall is None:
        return words
    return (
        f"{words} If every gear were measured as well and accepted by this rule, "
        f"{chance(overall)} of them would be accepted and exceed the limit (global "
        "risk)."
    )


def stated_words(stated: StatedUncertainty) -> str:
    """Return a result as it is stated: estimate, uncertainty, factor, coverage."""
    half, sd = stated.expanded_uncertainty_N, stated.combined_standard_uncertainty_N
    words = (
        f"{_digits(stated.estimate_N, half)} {{N}} ± {_upwards(half)} {{N}} (k = "
        f"{stated.coverage_factor:.2f}, 95 % coverage), u = {_digits(sd, sd)} {{N}}"
    )
    if stated.linear_budget_valid:
        return f"{words}."
    ends = stated.coverage_lo_N, stated.coverage_hi_N
    low, high = (_digits(end, half) for end in ends)
    return f"{words}; by Monte Carlo, whose coverage interval is {low} … {high} {{N}}."


def _upwards(uncertainty: float) -> str:
    """Return two digits of an uncertainty, never less than it (GUM, 7.2.6)."""
    if uncertainty == 0.0:
        return _digits(uncertainty, uncertainty)
    unit = 10.0 ** (np.floor(np.log10(uncertainty)) - 1.0)
    return _digits(unit * np.ceil(uncertainty / unit - 1e-9), uncertainty)


def _digits(value: float, uncertainty: float) -> str:
    """Return a number to the second digit of an uncertainty."""
    return number(value, 10.0 * uncertainty)


def more_is_asked(capacity: float, share: float, confidence: float) -> str:
    """Return why a force that conforms needs a larger capacity than its limit."""
    asked = f"{100.0 * share:.6g} % of them do with {100.0 * confidence:.6g} %"
    return (
        f" This asks whether one reading keeps the limit; that {asked} confidence, as "
        f"the answer above asks, takes {newtons(capacity)}."
    )
