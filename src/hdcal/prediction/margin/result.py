"""Margin as a result: bounds, budget, decision and inverse, with labels and units."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.inference.posterior import Posterior
from hdcal.prediction.conditions import Direction
from hdcal.prediction.forces import Quantity
from hdcal.prediction.margin.budget import BudgetRow
from hdcal.prediction.margin.charts import budget_chart, force_chart
from hdcal.prediction.margin.decision import Conformity
from hdcal.prediction.population import Population
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Count, Interval, Item, Probability, Words
from hdcal.report.item import quantity as labelled
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.result import Result

if TYPE_CHECKING:
    from datetime import date

_MEMBER = {"readings": "reading", "mountings": "mounting", "specimens": "gear"}
Share = Annotated[float, Field(gt=0.0, lt=1.0)]


class Exceedance(Item):
    """How probable it is that a member needs more than the capacity.

    Attributes:
        probability: of one future member, over all draws; an upper limit with 95 %
            confidence where the draws do not resolve it.
        error: Monte Carlo standard error of the probability.
        resolved: whether the draws resolve the probability.
        lo: lower end of the 95 % credible interval of the share of the population.
        hi: its upper end.
        at_confidence: share that is not exceeded with the stated confidence.
        beta: reliability index −Φ⁻¹(P); a lower limit where P is an upper one.
    """

    probability: Probability = labelled("probability that a member exceeds the limit")
    error: float = labelled("Monte Carlo standard error of the probability")
    resolved: bool = labelled("whether the draws resolve the probability")
    lo: Probability = labelled("share of members above the limit, lower end")
    hi: Probability = labelled("share of members above the limit, upper end")
    at_confidence: Probability = labelled("share of members above, confidence bound")
    beta: float = labelled("reliability index")


class Level(Item):
    """The force at one temperature.

    Attributes:
        tested: the data hold this deformation, temperature and direction.
        force_N: mean of the population, 95 % credible interval.
        member_N: one future member, 95 % predictive interval.
        lower_bound_N: exceeded by the share `content`, with the stated confidence.
        upper_bound_N: not exceeded by that share, with that confidence.
        capacity_N: least that holds the required probability, with confidence; a size
            along the direction of loading.
        capacity_median_N: the same with a confidence of a half.
    """

    temperature_C: float = labelled("temperature", "°C")
    tested: bool = labelled("tested")
    force_N: Interval = labelled("mean", "N")
    member_N: Interval = labelled("one member", "N")
    lower_bound_N: float = labelled("lower bound", "N")
    upper_bound_N: float = labelled("upper bound", "N")
    capacity_N: float = labelled("required capacity", "N")
    capacity_median_N: float = labelled("required capacity, 50 % confidence", "N")
    exceedance: Exceedance | None = labelled("limit exceeded")


class Reached(Item):
    """The deformation that a force reaches; None where it is not reached in the range.

    Attributes:
        searched_mm: range of deformation.
        median_mm: of the mean member, with the ends of its 95 % credible interval.
        lower_bound_mm: reached by the share `content`, with the stated confidence.
        upper_bound_mm: not passed by that share, with that confidence.
        tested: whether the data hold the whole of it.
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


class ModelBound(Item):
    """Bounds of one of several models alone, at the worst temperature."""

    model: Words = labelled("model")
    probability: Probability = labelled("probability")
    lower_bound_N: float = labelled("lower bound", "N")
    upper_bound_N: float = labelled("upper bound", "N")


class CalibrationSource(Item):
    """Gear and data of the calibration."""

    gear: str
    theory: str
    name: str
    rows: Count
    sha256: str


class Margin(Result):
    """The force needed at a deformation, and the margin of a capacity.

    Attributes:
        direction: up to load, down to unload.
        loading_sense: +1 in compression, -1 in tension; capacities and what
            exceeds them are sizes along it, forces and bounds have their sign.
        quantity: reading of the rig, or load on the gear.
        population: readings, mountings or specimens.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
        required_probability: that the capacities hold.
        limit_force_N: capacity asked about, its size.
        tolerances_mm: ± of the sizes by name.
        levels: one per temperature.
        worst: the level with the largest bound.
        estimate_N: estimate of one member there.
        combined_standard_uncertainty_N: of the estimate.
        coverage_factor: half width of the coverage interval over this uncertainty.
        expanded_uncertainty_N: half width of the coverage interval.
        budget: components of the uncertainty, the largest first.
        decision: whether the force keeps the limit.
        reached: deformation that a given force reaches.
        models: bounds of each model, if there are several.
        causes: probability of each hypothesis that was averaged over.
        weight_left_out: probability of hypotheses that were not calibrated.
        beyond_tested: distance of the deformation from the tested range, as a share of
            that range.
        interval: probability inside the intervals.
        posterior: of the most probable model.
        bend_N: mean and sd of the bend at the deformation.
        averaging: sentences on the hypotheses.
        warnings: on the residuals and the noise.
        turn_mm: deformation at which unloading begins.
    """

    template = "prediction/margin/report.md.j2"
    table = "levels"

    format: Literal["hdcal.margin/3"] = "hdcal.margin/3"
    deformation_mm: float = labelled("deformation", "mm")
    direction: Direction
    loading_sense: Literal[1, -1]
    quantity: Quantity
    population: Population
    content: Share
    confidence: Share
    required_probability: Share
    limit_force_N: float | None = labelled("limit", "N")
    tolerances_mm: dict[str, float]
    levels: Annotated[tuple[Level, ...], Field(min_length=1)]
    worst: Level
    estimate_N: float = labelled("estimate of one member", "N")
    combined_standard_uncertainty_N: float = labelled("standard uncertainty", "N")
    coverage_factor: float = labelled("coverage factor")
    expanded_uncertainty_N: float = labelled("expanded uncertainty", "N")
    budget: tuple[BudgetRow, ...]
    decision: Conformity | None
    reached: Reached | None
    models: tuple[ModelBound, ...]
    causes: dict[str, Probability]
    weight_left_out: Probability
    beyond_tested: float
    interval: Share
    seed: Count
    versions: dict[str, str]
    data: CalibrationSource
    posterior: InstanceOf[Posterior] = Field(exclude=True)
    bend_N: tuple[float, float] = Field(exclude=True)
    averaging: tuple[str, ...] = Field(exclude=True)
    warnings: tuple[str, ...] = Field(exclude=True)
    turn_mm: float = Field(exclude=True)

    @computed_field
    @property
    def extrapolated(self) -> tuple[Words, ...]:
        """What lies outside the data."""
        return self.lines("extrapolated")

    @computed_field
    @property
    def remarks(self) -> tuple[Words, ...]:
        """What else the numbers depend on."""
        return self.lines("remarks")

    @property
    def member(self) -> str:
        """Word for one member of the population."""
        is_load = self.quantity == "load" and self.population != "specimens"
        return "load" if is_load else _MEMBER[self.population]

    @property
    def members(self) -> str:
        """Word for several members of the population."""
        return f"{self.member}s"

    @property
    def step_N(self) -> float:
        """Step of the reading, 0 for a load [N]."""
        step = float(self.posterior.problem.step)
        return step if self.quantity == "reading" else 0.0

    @property
    def facts(self) -> dict[str, str]:
        """Gear, sizes and data in words."""
        case = self.posterior.case
        return dict(gear_rows(case, self.posterior.theory)) | dict(data_rows(case))

    def budget_frame(self) -> pd.DataFrame:
        """Return the uncertainty budget as a table."""
        rows = pd.DataFrame([row.columns() for row in self.budget])
        return rows.rename(columns=self.units.key)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the force with its bounds, and the budget."""
        return {"margin": force_chart(self), "budget": budget_chart(self)}

    def certificate(self, issued: "date") -> str:
        """Return the certificate as the text of an HTML page of one A4 sheet.

        Args:
            issued: date of issue.

        Raises:
            NotUsable: the calibration failed its checks.
        """
        from hdcal.report.page import sheet_page

        self.posterior.require_usable()
        return sheet_page(self, "certificate", {"date of issue": issued.isoformat()})
