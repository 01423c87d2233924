"""Charts of a margin: the force with its bounds, and the uncertainty budget."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hdcal.report.charts.axes import load_axis
from hdcal.report.charts.chart_spec import (
    BLUE,
    ORANGE,
    RED,
    Band,
    Bars,
    Chart,
    Line,
    Mark,
    Panel,
    Rule,
    beyond,
)

if TYPE_CHECKING:
    from hdcal.prediction.margin.result import Margin

# Rows of the budget below this share cannot be seen.
_SMALL = 1e-3


def force_chart(margin: "Margin") -> Chart:
    """Return the force with its bounds: at one temperature, or over several."""
    several, units, limit = len(margin.levels) > 1, margin.units, margin.limit_force_N
    bounds = f"{100.0 * margin.content:.6g}/{100.0 * margin.confidence:.6g} bounds"
    marks = [*(_over_temperature(margin, bounds) if several else _at_one(margin))]
    if limit is not None:
        label = f"limit {limit:g} {units.load_unit}"
        marks.append(Rule(at=margin.loading_sense * limit, label=label, colour=RED))
    at = f"{margin.deformation_mm:g} {units.displacement_unit}"
    panel = Panel(
        x="temperature [°C]" if several else "",
        y=load_axis(units),
        marks=marks,
        title=f"{margin.data.gear}: {units.load} needed at {at}",
        names=[] if several else [bounds, f"one {margin.member}, 95 %", "mean, 95 %"],
        horizontal=not several,
        y_limits=(None, None) if several else _limits(margin),
    )
    return Chart(panels=[panel])


def _limits(margin: "Margin") -> tuple[float, float]:
    """Return ends of the axis with room beside the bars."""
    ends = [margin.worst.lower_bound_N, margin.worst.upper_bound_N]
    if margin.limit_force_N is not None:
        ends.append(margin.loading_sense * margin.limit_force_N)
    room = 0.06 * (max(ends) - min(ends))
    return min(ends) - room, max(ends) + room


def _at_one(margin: "Margin") -> Iterator[Mark]:
    level = margin.worst
    low = [level.lower_bound_N, level.member_N.lo, level.force_N.lo]
    high = [level.upper_bound_N, level.member_N.hi, level.force_N.hi]
    yield Bars(at=np.arange(1.0, 4.0), low=np.array(low), high=np.array(high))


def _over_temperature(margin: "Margin", bounds: str) -> Iterator[Mark]:
    levels = sorted(margin.levels, key=lambda level: level.temperature_C)
    x = np.array([level.temperature_C for level in levels])
    untested = beyond(np.array([level.tested for level in levels]))
    for name, kind, opacity in (
        (f"one {margin.member}, 95 %", "member_N", 0.18),
        ("mean, 95 %", "force_N", 0.45),
    ):
        spans = [getattr(level, kind) for level in levels]
        low = np.array([span.lo for span in spans])
        high = np.array([span.hi for span in spans])
        yield Band(label=name, x=x, low=low, high=high, opacity=opacity)
        if kind == "member_N" and untested.any():
            yield Band(
                label="not tested: extrapolated",
                x=x,
                low=np.where(untested, low, np.nan),
                high=np.where(untested, high, np.nan),
                opacity=0.0,
                hatched=True,
            )
    for end, label in (("lower_bound_N", bounds), ("upper_bound_N", "")):
        y = np.array([getattr(level, end) for level in levels])
        yield Line(label=label, x=x, y=y, colour="", width=1.2)


def budget_chart(margin: "Margin") -> Chart:
    """Return the shares of the variance of one member's force."""
    rows = [row for row in margin.budget if row.share >= _SMALL][::-1]
    marks = []
    for kind, words, colour in (
        ("A", "A: from the readings", BLUE),
        ("B", "B: from other knowledge", ORANGE),
    ):
        places = np.array([i for i, row in enumerate(rows) if row.type_ == kind])
        if places.size:
            shares = np.array([100.0 * rows[i].share for i in places])
            marks.append(Bars(label=words, at=1.0 + places, high=shares, colour=colour))
    panel = Panel(
        x="",
        y="share of the variance [%]",
        marks=marks,
        title=f"uncertainty of one {margin.member}",
        names=[row.component for row in rows],
        horizontal=True,
        y_limits=(0.0, None),
    )
    return Chart(panels=[panel])
