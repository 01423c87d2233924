"""Chart of classical fits: readings with the curves, and the residuals."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.records import Records
from hdcal.report.charts.chart_spec import (
    CYCLE,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
)

if TYPE_CHECKING:
    from hdcal.classical.fit import Polynomial


def fit_chart(records: Records, fits: "Sequence[Polynomial]") -> Chart:
    """Return force over deformation, and the residuals of each curve."""
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    grid = np.linspace(min(0.0, x.min()), max(0.0, x.max()), 200)
    above: list[Mark] = []
    below: list[Mark] = [Rule(at=0.0)]
    for place, one in enumerate(fits):
        force, half, _ = one.curve(grid)
        name, hue = one.model, CYCLE[place % len(CYCLE)]
        low, high, left = force - half, force + half, y - one.curve(x)[0]
        dash = "solid" if one.intercept else "dashed"
        above.append(Band(label=name, x=grid, low=low, high=high, colour=hue))
        above.append(Line(label=name, x=grid, y=force, colour=hue, dash=dash))
        below.append(Points(label=name, x=x, y=left, colour=hue))
    above.append(Points(label="readings", x=x, y=y))
    axis = "deformation as read [mm]"
    force = Panel(x=axis, y="force as read [N]", marks=above, height=3.4)
    residual = Panel(x=axis, y="reading − curve [N]", marks=below, height=2.4)
    return Chart(panels=[force, residual], share_x=True)
