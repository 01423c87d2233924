"""Charts of a fleet: gears, readings, scatter, and changes with the date."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.records import Records
from hdcal.fleets.reading.readings import modulus_left
from hdcal.report.charts.axes import displacement_axis, load_axis
from hdcal.report.charts.chart_spec import (
    BLUE,
    CYCLE,
    GREY,
    ORANGE,
    PURPLE,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
    Span,
)

if TYPE_CHECKING:
    from hdcal.fleets.over_time import Change
    from hdcal.fleets.result import Fleet

# Gears that have their names beside them, and all that are drawn.
_MOST_NAMED, _MOST_DRAWN = 40, 4000
# Gears whose readings are shown: flagged ones in colours, others in grey.
_MOST_FLAGGED, _MOST_ORDINARY = 5, 40
# Half cycles of a flagged gear whose readings are joined by lines.
_MOST_HALF_CYCLES = 4


def gears_chart(fleet: "Fleet") -> Chart:
    """Return the stiffness of each gear with its interval, from soft to stiff."""
    table, units = fleet.gear_table, fleet.units
    table = table.sort_values("stiffness_N_per_mm", kind="stable")
    if len(table) > _MOST_DRAWN:
        # All flagged gears, and others from the softest to the stiffest.
        shown = table["flagged"].to_numpy(copy=True)
        shown[np.linspace(0, len(table) - 1, _MOST_DRAWN // 2).astype(int)] = True
        table = table.loc[shown]
    soft = table["flagged_in"].str.contains("stiffness").to_numpy()
    other = table["flagged"].to_numpy() & ~soft
    kinds = (
        ("ordinary", ~soft & ~other, BLUE),
        ("flagged in its stiffness", soft, ORANGE),
        ("flagged otherwise", other, PURPLE),
    )
    at = np.arange(1.0, len(table) + 1.0)
    median, low, high = (
        table[name].to_numpy()
        for name in ("stiffness_N_per_mm", "stiffness_lo", "stiffness_hi")
    )
    points = [
        Points(
            label=label,
            x=at[rows],
            y=median[rows],
            low=low[rows],
            high=high[rows],
            colour=colour,
        )
        for label, rows, colour in kinds
        if rows.any()
    ]
    centre = fleet.population.stiffness_N_per_mm
    span = Span(low=centre.lo, high=centre.hi, label="centre, 95 %", colour=GREY)
    few = len(table) <= _MOST_NAMED
    panel = Panel(
        x="" if few else f"{fleet.part}s in the order of their stiffness",
        y=f"{units.stiffness} as read [{units.stiffness_unit}]",
        marks=[span, *points],
        names=table["gear"].tolist(),
        horizontal=few,
        wide=True,
        height=1.2 + 0.22 * len(table) if few else 4.4,
    )
    return Chart(panels=[panel])


def curves_chart(fleet: "Fleet") -> Chart:
    """Return readings, and their distance from the straight line of the centre."""
    case, table = fleet.readings.case, fleet.gear_table
    records = case.records
    gear = np.asarray(records.specimen)
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    ratio = fleet.readings.size_ratio
    slope = fleet.population.stiffness_N_per_mm.median
    line = slope * x * (1.0 if ratio is None else ratio[gear])
    line *= modulus_left(case.gear, np.asarray(records.temperature))
    recorded = table.loc[np.unique(gear)]
    flagged = recorded[recorded["flagged"]]
    flagged = flagged.sort_values("probability_off", ascending=False, kind="stable")
    ordinary = recorded[~recorded["flagged"]].sort_values("stiffness_N_per_mm")
    some = np.linspace(0, len(ordinary) - 1, min(len(ordinary), _MOST_ORDINARY))
    groups = [
        (f"ordinary {fleet.part}s", ordinary.index[some.round().astype(int)], GREY)
    ]
    colours = (*CYCLE[1:], CYCLE[0])
    for place, colour in zip(flagged.index[:_MOST_FLAGGED], colours, strict=False):
        groups.append((table.loc[place, "gear"], [place], colour))
    shown = [(name, np.isin(gear, who), colour) for name, who, colour in groups]
    readings, distance = list[Mark](), list[Mark]([Rule(at=0.0)])
    for marks, values in ((readings, y), (distance, y - line)):
        for name, rows, colour in shown:
            if rows.any():
                each = {"x": x[rows], "y": values[rows], "colour": colour}
                marks.append(Points(label=name, **each))
    for _, rows, colour in shown[1:]:
        for piece in _half_cycles(records, np.flatnonzero(rows)):
            each = {"x": x[piece], "y": (y - line)[piece]}
            distance.append(Line(**each, colour=colour, width=1.0))
    axis = displacement_axis(case)
    panels = [
        Panel(x=axis, y=load_axis(case.units), marks=readings),
        Panel(
            x=axis,
            y=load_axis(case.units, "distance from the centre"),
            marks=distance,
        ),
    ]
    return Chart(panels=panels, share_x=True)


def _half_cycles(records: Records, rows: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the first half cycles of some rows, by ascending deformation."""
    sense, run = np.asarray(records.sense)[rows], np.asarray(records.run)[rows]
    turns = np.flatnonzero((np.diff(sense) != 0) | (np.diff(run) != 0)) + 1
    for piece in np.split(rows, turns)[:_MOST_HALF_CYCLES]:
        yield piece[np.argsort(np.asarray(records.deformation)[piece], kind="stable")]


def scatter_chart(fleet: "Fleet") -> Chart:
    """Return the standard deviation of the force by its sources."""
    names, sds, _, forces = zip(*fleet.scatter, strict=True)
    ends = np.array([(sd.median, sd.lo, sd.hi) for sd in sds]).T * np.array(forces)
    at = f"{abs(fleet.gauge_rr.deformation_mm):g} {fleet.units.displacement_unit}"
    points = Points(
        x=np.arange(1.0, len(names) + 1.0),
        y=ends[0],
        low=ends[1],
        high=ends[2],
        colour=BLUE,
    )
    panel = Panel(
        x="",
        y=load_axis(
            fleet.units, f"standard deviation of the {fleet.units.load} at {at}"
        ),
        marks=[points],
        names=names,
        horizontal=True,
        wide=True,
        y_limits=(0.0, None),
        height=1.1 + 0.35 * len(names),
    )
    return Chart(panels=[panel])


def time_chart(fleet: "Fleet") -> Chart:
    """Return stiffness, zero and noise against the date, with steps and drifts."""
    begin = min(change.values.day[0] for change in fleet.over_time)
    panels = [_change_panel(change, begin) for change in fleet.over_time]
    return Chart(panels=panels)


def _change_panel(change: "Change", begin: np.datetime64) -> Panel:
    values = change.values

    def days(date: str) -> float:
        return (np.datetime64(date) - begin).astype(float)

    x, y = (values.day - begin).astype(float), values.value
    half, out = 1.96 * values.sd, values.left_out
    marks: list[Mark] = [Rule(at=0.0, dash="dotted")]
    if change.changed and change.likeliest == "steps":
        for step in change.steps:
            ends = days(step.after), days(step.before)
            marks.append(Span(low=ends[0], high=ends[1], axis="x", label="step"))
    if change.changed and change.likeliest == "drift":
        ends = np.array([days(change.first), days(change.last)])
        half_drift = change.drift.median * np.array([-0.5, 0.5])
        marks.append(Line(label="drift", x=ends, y=half_drift, colour=GREY))
    for label, rows, colour in (("", ~out, BLUE), ("left out", out, ORANGE)):
        if rows.any():
            low, high = y[rows] - half[rows], y[rows] + half[rows]
            each = {"x": x[rows], "y": y[rows], "low": low, "high": high}
            marks.append(Points(label=label, colour=colour, **each))
    return Panel(
        x=f"days since {begin}",
        y=f"{change.what} [{change.unit}]",
        marks=marks,
        wide=True,
        height=2.4,
    )
