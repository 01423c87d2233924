"""Residuals as a result: their shapes, their table and their chart."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, InstanceOf

from hdcal.calibration.charts import residual_chart
from hdcal.inference.force_model.residuals import Residuals
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Item, Words, quantity
from hdcal.report.result import Result

if TYPE_CHECKING:
    import pandas as pd


class ResidualShape(Item):
    """A shape of the residuals that noise would rarely have.

    Attributes:
        name: what they depend on.
        p_value: adjusted for the number of shapes tried.
        size_N: root mean square of the shape.
        words: one sentence.
    """

    name: str
    p_value: Annotated[float, Field(ge=0.0, le=1.0)]
    size_N: Annotated[float, Field(ge=0.0)]
    words: Words


class ResidualReport(Result):
    """Residuals of a calibration.

    Attributes:
        shapes: those that noise would rarely have.
        rms_N: root mean square.
        left: residuals by row.
    """

    template = "calibration/residuals.md.j2"

    format: Literal["hdcal.residuals/1"] = "hdcal.residuals/1"
    shapes: tuple[ResidualShape, ...]
    rms_N: float = quantity("root mean square", "N")
    left: InstanceOf[Residuals] = Field(exclude=True)

    def to_frame(self) -> "pd.DataFrame":
        """Return the rows."""
        import pandas as pd

        left = self.left
        frame = pd.DataFrame(
            {
                "deformation_mm": left.deformation,
                "temperature_C": left.temperature,
                "direction": left.direction,
                "run": left.run,
                "measured_N": left.measured,
                "fitted_N": left.fitted,
                "residual_N": left.residual,
                "standardised": left.standardised,
            }
        )
        return frame.rename(columns=self.units.key)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the standardised residuals."""
        return {"residuals": residual_chart(self.left)}


def residual_report(left: Residuals) -> ResidualReport:
    """Return residuals as a result."""
    rms = float(np.sqrt(np.mean(left.residual**2)))
    shapes = residual_shapes(left)
    return ResidualReport(shapes=shapes, rms_N=rms, left=left, units=left.units)


def residual_shapes(left: Residuals) -> tuple[ResidualShape, ...]:
    """Return the shapes of residuals, those of the noise last."""
    return tuple(
        ResidualShape(name=s.name, p_value=s.p_value, size_N=s.size_N, words=s.words)
        for s in (*left.structure, *left.noise)
    )
