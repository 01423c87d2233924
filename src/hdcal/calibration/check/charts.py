"""Chart of the readings of a case, with the rows that were left out as crosses."""

from collections.abc import Iterable, Iterator

import numpy as np

from hdcal.data.case import Case
from hdcal.data.loading import movement_words
from hdcal.report.charts.axes import displacement_axis, load_axis
from hdcal.report.charts.chart_spec import CYCLE, Chart, Panel, Points, drawn_rows
from hdcal.screening.result import REPEATED, SEGMENT_WORDS, SEGMENTS, Screening

# A row that repeats the one before would hide it.
_DRAWN = [place for place in range(len(SEGMENTS)) if place != REPEATED]


def readings_chart(case: Case) -> Chart:
    """Return force over deformation; specimens, runs or movements have colours."""
    marks = [*_members(case)]
    if case.screening is not None:
        marks += left_out(case.screening)
    x, y = displacement_axis(case), load_axis(case.units, f"{case.units.load} as read")
    panel = Panel(x=x, y=y, marks=marks, title=f"{case.name}: readings")
    return Chart(panels=[panel])


def _members(case: Case) -> Iterator[Points]:
    """Yield the rows of each specimen, or of each run, of one run of each movement."""
    records = case.records
    read, kind = np.asarray(records.deformation), ""
    movements = movement_words(case.from_unloaded, case.units.displacement)
    names = [*movements.values()]
    index = (np.asarray(records.sense) != next(iter(movements))).astype(int)
    for each, labels in (("run", case.run_labels), ("specimen", case.specimen_labels)):
        if len(labels) > 1:
            kind, index = f"{each} ", np.asarray(getattr(records, each))
            names = labels
    drawn = drawn_rows(np.asarray(records.force))
    x, y, group = (np.asarray(values)[drawn] for values in (read, records.force, index))
    groups = np.unique(group)
    for place in groups:
        yield Points(
            label=f"{kind}{names[place]}" if len(groups) > 1 else "",
            x=x[group == place],
            y=y[group == place],
            colour=CYCLE[place % len(CYCLE)],
        )


def left_out(found: Screening, segments: Iterable[int] = _DRAWN) -> Iterator[Points]:
    """Yield the rows that were left out, as crosses, each segment in its colour."""
    some = np.flatnonzero(~found.kept & np.isin(found.segment, [*segments]))
    some = some[drawn_rows(found.force[some])]
    for segment in np.unique(found.segment[some]):
        these, name = some[found.segment[some] == segment], SEGMENTS[segment]
        yield Points(
            label=f"left out: {SEGMENT_WORDS.get(name, name)}",
            x=found.deformation[these],
            y=found.force[these],
            colour=CYCLE[(segment + 1) % len(CYCLE)],
            marker="X",
        )
