"""Chart of a comparison."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdcal.quantities import Quantities
from hdcal.report.charts.chart_spec import ORANGE, Chart, Panel, Points

if TYPE_CHECKING:
    from hdcal.comparison.compare import Compared


def stiffness_chart(results: "Sequence[Compared]", units: Quantities) -> Chart:
    """Return the stiffness of each result with its interval."""
    spans = [one.stiffness_N_per_mm for one in results]
    median, low, high = np.transpose([(s.median, s.lo, s.hi) for s in spans])
    x, label = np.arange(1.0, len(spans) + 1.0), "median and 95 % credible interval"
    points = Points(label=label, x=x, y=median, low=low, high=high, colour=ORANGE)
    axis = f"{units.stiffness} as read [{units.stiffness_unit}]"
    names = [one.name for one in results]
    return Chart(panels=[Panel(x="result", y=axis, marks=[points], names=names)])
