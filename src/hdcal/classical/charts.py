"""Chart of classical fits: readings with the curves, and the residuals."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.records import Records
from hdcal.report.chart_spec import CYCLE, Band, Chart, Line, Mark, Panel, Points, Rule

if TYPE_CHECKING:
    from hdcal.classical.polynomial import Polynomial

_DEFORMATION = "deformation as read [mm]"


def fit_chart(records: Records, fits: "Sequence[Polynomial]") -> Chart:
    """Return force over deformation, and the residuals of each curve."""
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    grid = np.linspace(min(0.0, x.min()), max(0.0, x.max()), 200)
    above: list[Mark] = []
    below: list[Mark] = [Rule(at=0.0)]
    for place, one in enumerate(fits):
        colour = CYCLE[place % len(CYCLE)]
        along = [one.force_at(value) for value in grid]
        force, low, high = (
            np.array([getattr(each, name) for each in along])
            for name in ("force_N", "lo_N", "hi_N")
        )
        dash = "solid" if one.intercept else "dashed"
        above += [
            Band(label=one.model, x=grid, low=low, high=high, colour=colour),
            Line(label=one.model, x=grid, y=force, colour=colour, dash=dash),
        ]
        residual = y - np.polyval(one.polyfit_order, x)
        below.append(Points(label=one.model, x=x, y=residual, colour=colour))
    above.append(Points(label="readings", x=x, y=y))
    return Chart(
        panels=[
            Panel(x=_DEFORMATION, y="force as read [N]", marks=above, height=3.4),
            Panel(x=_DEFORMATION, y="reading − curve [N]", marks=below, height=2.4),
        ],
        share_x=True,
    )
