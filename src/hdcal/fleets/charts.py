"""Charts of a fleet: gears, readings, and changes with the date."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.fleets.gear_table import ranked
from hdcal.fleets.reading.readings import relative_modulus
from hdcal.report.charts.axes import displacement_axis, load_axis
from hdcal.report.charts.chart_spec import (
    BLUE,
    CYCLE,
    GREY,
    ORANGE,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
    Span,
)
from hdcal.screening.result import NORMAL_95

if TYPE_CHECKING:
    from hdcal.fleets.over_time import Change
    from hdcal.fleets.result import Fleet

# Gears that have their names beside them, and all that are drawn.
_MOST_NAMED, _MOST_DRAWN = 40, 4000
# Gears whose readings are shown, flagged and others.
_MOST_FLAGGED, _MOST_ORDINARY = 5, 40


def gears_chart(fleet: "Fleet") -> Chart:
    """Return the stiffness of each gear with its interval, from soft to stiff."""
    table, units = fleet.gear_table, fleet.units
    table = table.sort_values("stiffness_N_per_mm", kind="stable")
    if len(table) > _MOST_DRAWN:
        # All flagged gears, and others from the softest to the stiffest.
        shown = table["flagged"].to_numpy(copy=True)
        shown[np.linspace(0, len(table) - 1, _MOST_DRAWN // 2).astype(int)] = True
        table = table.loc[shown]
    table = table.assign(at=np.arange(1.0, len(table) + 1.0))
    kinds = ("ordinary", ~table["flagged"], BLUE), ("flagged", table["flagged"], ORANGE)
    centre = fleet.population.stiffness_N_per_mm
    marks: list[Mark] = [
        Span(low=centre.lo, high=centre.hi, label="centre, 95 %", colour=GREY)
    ]
    names = ("at", "stiffness_N_per_mm", "stiffness_lo", "stiffness_hi")
    for label, rows, colour in kinds:
        x, y, low, high = (table.loc[rows, name].to_numpy() for name in names)
        if len(x):
            each = {"x": x, "y": y, "low": low, "high": high}
            marks.append(Points(label=label, colour=colour, **each))
    few = len(table) <= _MOST_NAMED
    panel = Panel(
        x="" if few else f"{fleet.part}s in the order of their stiffness",
        y=f"{units.stiffness} as read [{units.stiffness_unit}]",
        marks=marks,
        names=table["gear"].tolist(),
        horizontal=few,
        wide=True,
        height=1.2 + 0.22 * len(table) if few else 4.4,
    )
    return Chart(panels=[panel])


def curves_chart(fleet: "Fleet") -> Chart:
    """Return the distance of readings from the straight line of the centre."""
    case, ratio = fleet.readings.case, fleet.readings.size_ratio
    gear, x, y, warm = (
        np.asarray(getattr(case.records, name))
        for name in ("specimen", "deformation", "force", "temperature")
    )
    line = fleet.population.stiffness_N_per_mm.median * x
    line *= relative_modulus(case.gear, warm) * (1.0 if ratio is None else ratio[gear])
    table = fleet.gear_table.loc[np.unique(gear)]
    flagged = ranked(table[table["flagged"]]).head(_MOST_FLAGGED)
    ordinary = table[~table["flagged"]].sort_values("stiffness_N_per_mm")
    some = np.linspace(0, len(ordinary) - 1, min(len(ordinary), _MOST_ORDINARY))
    shown = [(f"ordinary {fleet.part}s", ordinary.index[some.round().astype(int)])]
    shown += [(str(flagged["gear"][index]), [index]) for index in flagged.index]
    marks: list[Mark] = [Rule(at=0.0)]
    for (name, gears), colour in zip(shown, (GREY, *CYCLE[1:]), strict=False):
        rows = np.isin(gear, gears)
        if rows.any():
            distance = y[rows] - line[rows]
            read = x[rows] + fleet.readings.contact
            marks.append(Points(label=name, colour=colour, x=read, y=distance))
    axis = load_axis(case.units, "distance from the centre")
    return Chart(panels=[Panel(x=displacement_axis(case), y=axis, marks=marks)])


def time_chart(fleet: "Fleet") -> Chart:
    """Return stiffness, zero and noise against the date, with steps and drifts."""
    begin = min(np.datetime64(change.first) for change in fleet.over_time)
    return Chart(panels=[_change_panel(change, begin) for change in fleet.over_time])


def _change_panel(change: "Change", begin: np.datetime64) -> Panel:
    def days(dates) -> np.ndarray:
        return (np.asarray(dates, "M8[D]") - begin).astype(float)

    marks: list[Mark] = [Rule(at=0.0, dash="dotted")]
    if change.changed and change.likeliest == "steps":
        for step in change.steps:
            low, high = days([step.after, step.before])
            marks.append(Span(low=low, high=high, axis="x", label="step"))
    if change.changed and change.likeliest == "drift":
        ends, half = days([change.first, change.last]), 0.5 * change.drift.median
        drift = np.array([-half, half])
        marks.append(Line(label="drift", x=ends, y=drift, colour=GREY))
    for left_out, values in change.values.groupby("left_out"):
        y, half = values["value"].to_numpy(), NORMAL_95 * values["sd"].to_numpy()
        label, colour = ("left out", ORANGE) if left_out else ("", BLUE)
        each = {"x": days(values["day"]), "y": y, "low": y - half, "high": y + half}
        marks.append(Points(label=label, colour=colour, **each))
    return Panel(
        x=f"days since {begin}",
        y=f"{change.what} [{change.unit}]",
        marks=marks,
        wide=True,
        height=2.4,
    )
