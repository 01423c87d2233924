"""What a margin states in the terms of metrology: budget, uncertainty and decision."""

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from hdcal.report.answer import Promise, Real, Words

Chance = Annotated[float, Promise(minimum=0, maximum=1)]
Size = Annotated[float, Promise(minimum=0)]
Rule = Literal["guarded", "simple"]
RULES: tuple[Rule, ...] = get_args(Rule)
Statement = Literal["conforms", "does not conform", "undecided"]


@dataclass(frozen=True)
class BudgetLine:
    """One component of the uncertainty.

    Attributes:
        component: what it is.
        type: A where the readings tell of it, B where something else does.
        distribution: in words.
        standard_uncertainty: in its own unit.
        unit: of it.
        sensitivity_N_per_unit: derivative of the force by the component.
        contribution_N: standard uncertainty of the force that it makes.
        share: of the variance; those of all components sum to 1.
        halved_by: what would halve the contribution.
    """

    component: Words
    type: Literal["A", "B"]
    distribution: Words
    standard_uncertainty: Size
    unit: Words
    sensitivity_N_per_unit: float
    contribution_N: Size
    share: Chance
    halved_by: Words


@dataclass(frozen=True)
class BudgetCheck:
    """The linear budget beside Monte Carlo, as JCGM 101:2008, clause 8, asks.

    Attributes:
        estimate_N: of the linear budget.
        standard_uncertainty_N: root of the sum of its squared contributions.
        degrees_of_freedom: effective; null where they are infinite.
        coverage_factor: of 95 %.
        lo_N: lower end of its 95 % interval.
        hi_N: upper end.
        monte_carlo_lo_N: lower end by Monte Carlo.
        monte_carlo_hi_N: upper end.
        tolerance_N: how far the ends may differ: half a unit in the second digit of
            the standard uncertainty.
        monte_carlo_error_N: standard error of the ends by Monte Carlo.
        words: what came out.
    """

    estimate_N: float
    standard_uncertainty_N: Size
    degrees_of_freedom: Real
    coverage_factor: Size
    lo_N: float
    hi_N: float
    monte_carlo_lo_N: float
    monte_carlo_hi_N: float
    tolerance_N: Size
    monte_carlo_error_N: Size
    words: Words


@dataclass(frozen=True, kw_only=True, repr=False)
class StatedUncertainty:
    """The force of one future member at the worst temperature, as a result is stated.

    Attributes:
        budget: its components, the largest first; none without sensitivities.
        estimate_N: y.
        combined_standard_uncertainty_N: u.
        coverage_factor: k = U/u.
        expanded_uncertainty_N: U of 95 %, half the coverage interval.
        coverage_lo_N: lower end of the 95 % coverage interval.
        coverage_hi_N: upper end; y ± U where the linear budget is valid.
        linear_budget_valid: whether these numbers are those of the linear budget; else
            they are those of Monte Carlo. None without a budget.
        linear_check: how the two compare, or None.
    """

    budget: tuple[BudgetLine, ...]
    estimate_N: float
    combined_standard_uncertainty_N: Size
    coverage_factor: Size
    expanded_uncertainty_N: Size
    coverage_lo_N: float
    coverage_hi_N: float
    linear_budget_valid: bool | None
    linear_check: BudgetCheck | None


@dataclass(frozen=True)
class Decision:
    """Whether the force keeps the limit, and by which rule.

    Limit, guard band and acceptance limit are sizes along the sense of loading.

    Attributes:
        rule: guarded or simple.
        limit_N: that must not be exceeded.
        guard_band_N: how far the acceptance limit lies below it.
        acceptance_limit_N: largest estimate that is accepted.
        statement: what is decided.
        probability_of_conformity: that one future member keeps the limit.
        false_accept_risk: that it does not, if it is accepted (specific risk).
        global_false_accept_risk: that a gear of this kind exceeds the limit and is
            accepted, if each were measured so well; null unless gears were asked for.
        rule_words: the rule in words.
        words: the decision in words.
    """

    rule: Rule
    limit_N: float
    guard_band_N: Size
    acceptance_limit_N: float
    statement: Statement
    probability_of_conformity: Chance
    false_accept_risk: Chance
    global_false_accept_risk: Chance | None
    rule_words: Words
    words: Words
