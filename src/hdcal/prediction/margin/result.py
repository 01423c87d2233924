"""Margin as a result: bounds, budget, decision and inverse, with labels and units."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.budget import BudgetRow
from hdcal.prediction.margin.charts import budget_chart, force_chart
from hdcal.prediction.margin.levels import Conformity, Level
from hdcal.prediction.margin.reached import Reached
from hdcal.prediction.margin.request import MarginRequest, Share, is_stated
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import INTERVAL, Count, Item, Probability, Words
from hdcal.report.item import quantity as labelled
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.result import Result
from hdcal.versions import versions

if TYPE_CHECKING:
    from datetime import date

_MEMBER = {"readings": "reading", "mountings": "mounting", "specimens": "gear"}


class CalibrationSource(Item):
    """Gear and data of the calibration."""

    gear: str
    theory: str
    name: str
    rows: Count
    sha256: str


class Margin(MarginRequest, Result):
    """The force needed at a deformation, and the margin of a capacity.

    Of one level per temperature the worst has the largest bound; estimate, budget and
    decision are of one member there. `beyond_tested` is the distance from the tested
    range as a share of it, `bend_N` mean and sd of the bend, `turn_mm` where unloading
    begins.
    """

    template = "prediction/margin/report.md.j2"
    table = "levels"

    format: Literal["hdcal.margin/3"] = "hdcal.margin/3"
    levels: Annotated[tuple[Level, ...], Field(min_length=1)]
    worst: Level
    estimate_N: float = labelled("estimate of one member", "N")
    combined_standard_uncertainty_N: float = labelled("standard uncertainty", "N")
    coverage_factor: float = labelled("coverage factor")
    expanded_uncertainty_N: float = labelled("expanded uncertainty", "N")
    budget: tuple[BudgetRow, ...]
    decision: Conformity | None
    reached: Reached | None
    causes: dict[str, Probability]
    weight_left_out: Probability
    beyond_tested: float
    interval: Share = INTERVAL
    versions: dict[str, str] = Field(default_factory=versions)
    data: CalibrationSource
    posterior: InstanceOf[Posterior] = Field(exclude=True)
    bend_N: tuple[float, float] = Field(exclude=True)
    averaging: tuple[str, ...] = Field(exclude=True)
    warnings: tuple[str, ...] = Field(exclude=True)
    turn_mm: float = Field(exclude=True)
    step_N: float = Field(exclude=True)

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
    def is_zero_unread(self) -> bool:
        """Whether a zero is the largest component, and nobody stated the gauge's."""
        largest, stated = self.budget[0], is_stated(self.posterior, "force_offset")
        return not stated and largest.input in ("deformation_offset", "force_offset")

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
        """Return the certificate, with its date of issue, as a page of HTML.

        Raises:
            NotUsable: the calibration failed its checks.
        """
        from hdcal.report.page import sheet_page

        self.posterior.require_usable()
        return sheet_page(self, "certificate", {"date of issue": issued.isoformat()})
