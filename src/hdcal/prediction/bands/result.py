"""Bands as a result: the table of the force with labels and units."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, computed_field

from hdcal.prediction.bands.charts import bands_chart
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Draws, Interval, Probability, quantity
from hdcal.report.result import Result


class Bands(Result):
    """Equal-tailed bands of the force as read, with one entry per row.

    The band of the mean is without a fitted discrepancy; with it, it is NaN if none was
    fitted. That of one new reading is on a new run and a new specimen where these were
    fitted, with the rounding of the rig. `straight_N` is the median of the model
    without the bend that the readings leave possible, `beyond_tested` the largest
    distance from the tested deformations, as a share of their range.
    """

    template = "prediction/bands/report.md.j2"
    table = "values"

    format: Literal["hdcal.prediction/1"] = "hdcal.prediction/1"
    deformation_mm: Draws = quantity("deformation", "mm")
    temperature_C: Draws = quantity("temperature", "°C")
    direction: Draws = quantity("direction")
    physics_lo_N: Draws = quantity("mean, lower end", "N")
    physics_median_N: Draws = quantity("mean", "N")
    physics_hi_N: Draws = quantity("mean, upper end", "N")
    with_gap_lo_N: Draws = quantity("with the discrepancy, lower end", "N")
    with_gap_median_N: Draws = quantity("with the discrepancy", "N")
    with_gap_hi_N: Draws = quantity("with the discrepancy, upper end", "N")
    new_measurement_lo_N: Draws = quantity("one new reading, lower end", "N")
    new_measurement_median_N: Draws = quantity("one new reading", "N")
    new_measurement_hi_N: Draws = quantity("one new reading, upper end", "N")
    tested: Draws = quantity("tested")
    usable: Draws = quantity("usable")
    straight_N: Draws
    interval: float = Field(gt=0.0, lt=1.0)
    causes: dict[str, Probability]
    weight_left_out: Probability
    averaging: tuple[str, ...] = Field(exclude=True)
    tested_range: str = Field(exclude=True)
    beyond_tested: float = Field(exclude=True)
    contact: float = Field(exclude=True)

    @computed_field(
        alias="columns", json_schema_extra={"additionalProperties": {"type": "array"}}
    )
    @property
    def values(self) -> dict[str, tuple[Any, ...]]:
        """Columns of the table by name; what was not fitted is null."""
        return {
            str(key): tuple(None if value != value else value for value in values)
            for key, values in self.to_frame().items()
        }

    def to_frame(self) -> pd.DataFrame:
        """Return the table of bands.csv."""
        columns = {self.units.key(name): getattr(self, name) for name in COLUMNS}
        return pd.DataFrame(columns)

    @property
    def untested(self) -> int:
        """Number of rows outside the data."""
        return int(np.sum(~self.tested))

    @property
    def mean_N(self) -> Interval:
        """Mean force at the first row, with the discrepancy where one was fitted."""
        ends = (self.physics_median_N, self.physics_lo_N, self.physics_hi_N)
        if np.isfinite(self.with_gap_median_N[0]):
            ends = (self.with_gap_median_N, self.with_gap_lo_N, self.with_gap_hi_N)
        median, lo, hi = (float(end[0]) for end in ends)
        return Interval(median=median, lo=lo, hi=hi)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return force over deformation."""
        return {"bands": bands_chart(self)}


# Columns of bands.csv, in their order.
COLUMNS = tuple(
    name for name, field in Bands.model_fields.items() if field.exclude and field.title
)
