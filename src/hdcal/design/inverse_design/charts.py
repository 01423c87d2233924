"""Chart of an inverse design: the force over a free size, the limit and the choice."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.design.inverse_design.candidate import spreads
from hdcal.design.sizes import named
from hdcal.report.chart_spec import (
    BLUE,
    INK,
    ORANGE,
    PURPLE,
    RED,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
)

if TYPE_CHECKING:
    from hdcal.design.inverse_design.inverse_design import InverseDesign

_TAILS = np.array([0.025, 0.5, 0.975])
# Points along a curve.
_FINE = 41


def limit_chart(found: "InverseDesign") -> Chart:
    """Return the force over each free size, the others as chosen."""
    panels = [_panel(found, name) for name in found.asked.bounds]
    return Chart(panels=panels)


def _panel(found: "InverseDesign", name: str) -> Panel:
    asked, chosen = found.asked, found.design
    along = np.linspace(*asked.bounds[name], _FINE)
    others = {n: np.full(_FINE, size) for n, size in chosen.sizes.items()}
    lo, middle, hi, kept = asked.sense * spreads(
        found.target, {**others, name: along}, _TAILS
    )
    share = f"not exceeded with probability {asked.probability:g}"
    lo, hi = np.sort([lo, hi], axis=0)
    limit = asked.sense * asked.limit_force_N
    marks: list[Mark] = [
        Band(label="median and 95 %", x=along, low=lo, high=hi),
        Line(label="median and 95 %", x=along, y=middle, colour=BLUE),
        Line(label=share, x=along, y=kept, colour=PURPLE, dash="dashed"),
        Rule(label=f"limit {limit:g} N", at=limit, colour=RED),
        _point("chosen", chosen.sizes[name], chosen.force_N.kept, INK),
        _point("tested gear", found.own_size(name), found.tested.force_N.kept, ORANGE),
    ]
    title = f"Force at {asked.deformation_mm:g} mm, {chosen.material}"
    x, height = f"{named(name)} [mm]", 4.4 if len(asked.bounds) == 1 else 3.0
    return Panel(title=title, x=x, y="force [N]", marks=marks, height=height)


def _point(label: str, size: float, force: float, colour: str) -> Points:
    return Points(label=label, x=np.array([size]), y=np.array([force]), colour=colour)
