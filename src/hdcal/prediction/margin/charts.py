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


def force_chart(found: "Margin") -> Chart:
    """Return the force with its bounds: at one temperature, or over several."""
    several = len(found.levels) > 1
    marks = [*(_over_temperature(found) if several else _at_one(found))]
    if found.limit_force_N is not None:
        limit = found.loading_sense * found.limit_force_N
        name = f"limit {found.limit_force_N:g} {found.units.load_unit}"
        marks.append(Rule(at=limit, label=name, colour=RED))
    at = f"{found.deformation_mm:g} {found.units.displacement_unit}"
    title = f"{found.data.gear}: {found.units.load} needed at {at}"
    if several:
        panel = Panel(
            x="temperature [°C]", y=load_axis(found.units), marks=marks, title=title
        )
    else:
        panel = Panel(
            x="",
            y=load_axis(found.units),
            marks=marks,
            title=title,
            names=[
                f"{_bounds(found)} bounds",
                f"one {found.member}, 95 %",
                "mean, 95 %",
            ],
            horizontal=True,
            y_limits=_limits(found),
        )
    return Chart(panels=[panel])


def _limits(found: "Margin") -> tuple[float, float]:
    """Return ends of the axis with room beside the bars."""
    level, sign = found.worst, found.loading_sense
    ends = [level.lower_bound_N, level.upper_bound_N]
    ends += [] if found.limit_force_N is None else [sign * found.limit_force_N]
    room = 0.06 * (max(ends) - min(ends))
    return min(ends) - room, max(ends) + room


def _bounds(found: "Margin") -> str:
    return f"{100.0 * found.content:.6g}/{100.0 * found.confidence:.6g}"


def _at_one(found: "Margin") -> Iterator[Mark]:
    level = found.worst
    low = [level.lower_bound_N, level.member_N.lo, level.force_N.lo]
    high = [level.upper_bound_N, level.member_N.hi, level.force_N.hi]
    yield Bars(at=np.arange(1.0, 4.0), low=np.array(low), high=np.array(high))


def _over_temperature(found: "Margin") -> Iterator[Mark]:
    levels = sorted(found.levels, key=lambda level: level.temperature_C)
    x = np.array([level.temperature_C for level in levels])
    untested = beyond(np.array([level.tested for level in levels]))
    for name, kind, opacity in (
        (f"one {found.member}, 95 %", "member_N", 0.18),
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
    for end, label in (
        ("lower_bound_N", f"{_bounds(found)} bounds"),
        ("upper_bound_N", ""),
    ):
        y = np.array([getattr(level, end) for level in levels])
        yield Line(label=label, x=x, y=y, colour="", width=1.2)


def budget_chart(found: "Margin") -> Chart:
    """Return the shares of the variance of one member's force."""
    rows = [row for row in found.budget if row.share >= _SMALL][::-1]
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
        title=f"uncertainty of one {found.member}",
        names=[row.component for row in rows],
        horizontal=True,
        y_limits=(0.0, None),
    )
    return Chart(panels=[panel])
