"""Response of a gear to a force as a result: motion and quantities of the gear."""

from collections.abc import Mapping
from typing import Literal

import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.inference.posterior import Posterior
from hdcal.motion.charts import response_chart
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import INTERVAL, Count, Interval, Item, Words, quantity
from hdcal.report.provenance import gear_rows
from hdcal.report.result import Result

_BAND = (
    "equal-tailed pointwise credible band of the deformation of gears like the tested "
    "one, without reading noise"
)


class Estimate(Interval):
    """A quantity, and whether data, a prior or the user determine it."""

    driven_by: Literal["data", "prior", "given"]


class Estimates(Item):
    """Quantities of the gear without effects, and its peak deformation."""

    natural_frequency_Hz: Estimate = quantity("natural frequency", "Hz")
    damped_frequency_Hz: Estimate = quantity("damped natural frequency", "Hz")
    damping_ratio: Estimate = quantity("damping ratio ζ")
    damping_N_s_per_mm: Estimate = quantity("damping c", "N·s/mm")
    mass_kg: Estimate = quantity("moved mass m", "kg")
    stiffness_N_per_mm: Estimate = quantity("stiffness k", "N/mm")
    peak_mm: Estimate = quantity("largest deformation", "mm")


class Response(Result):
    """The motion under a force, from the unloaded gear, with pointwise bands.

    `looped` is whether the discrepancy differs between loading and unloading.
    """

    template = "motion/response.md.j2"

    format: Literal["hdcal.response/1"] = "hdcal.response/1"
    gear: str
    calibration: Literal["moving", "at rest"]
    force: str
    temperature_C: float
    estimates: Estimates
    interval: float = INTERVAL
    interval_kind: str = _BAND
    tested_share: float = Field(ge=0.0, le=1.0)
    effects: tuple[str, ...]
    left_out: tuple[str, ...]
    draws: Count
    points: Count
    motion: pd.DataFrame = Field(exclude=True)
    posterior: InstanceOf[Posterior] = Field(exclude=True)
    looped: bool = Field(exclude=True)
    averaging: tuple[str, ...] = Field(exclude=True)

    @computed_field
    @property
    def remarks(self) -> tuple[Words, ...]:
        """Limits of the answer, in sentences."""
        return self.lines("remarks")

    @computed_field(alias="columns")
    @property
    def columns_of_motion(self) -> dict[str, list[float | bool]]:
        """The motion by column; response.csv."""
        return {str(name): each.tolist() for name, each in self.motion.items()}

    @property
    def facts(self) -> list[tuple[str, str]]:
        """The tested gear, as pairs of name and text."""
        return gear_rows(self.posterior.case, self.posterior.theory)

    def to_frame(self) -> pd.DataFrame:
        """Return the motion, a row per time."""
        return self.motion

    def make_charts(self) -> Mapping[str, Chart]:
        """Return deformation and force over time."""
        return {"response": response_chart(self.motion)}
