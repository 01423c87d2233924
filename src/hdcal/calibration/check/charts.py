"""Chart of the readings of a case, with the segments of the record in colour."""

from collections.abc import Iterable, Iterator

import numpy as np

from hdcal.data.case import Case
from hdcal.report.charts.axes import displacement_axis
from hdcal.report.charts.chart_spec import (
    CYCLE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    YELLOW,
    Chart,
    Panel,
    Points,
    drawn_rows,
)
from hdcal.screening.result import REPEATED, SEGMENTS, Screening

# Of the segments of a record; runs and specimens have the colours of the cycle.
_COLOURS = dict(
    zip(
        SEGMENTS,
        (CYCLE[0], ORANGE, GREEN, PURPLE, RED, YELLOW, SKY, GREY, GREY),
        strict=True,
    )
)
# A row that repeats the one before would hide it.
_DRAWN = [place for place in range(len(SEGMENTS)) if place != REPEATED]


def readings_chart(case: Case) -> Chart:
    """Return force over deformation, with rows that were left out as crosses.

    Each specimen has a colour, or else each run; of one run each segment.
    """
    found = case.screening
    several = max(len(case.specimen_labels), len(case.run_labels)) > 1
    marks = [*(_members(case) if several or found is None else _kept(found))]
    panel = Panel(
        x=displacement_axis(case),
        y=f"{case.units.load} as read [{case.units.load_unit}]",
        marks=[*marks, *([] if found is None else left_out(found))],
        title=f"{case.name}: readings",
    )
    return Chart(panels=[panel])


def _members(case: Case) -> Iterator[Points]:
    """Yield the rows of each specimen, or of each run."""
    records = case.records
    several = len(case.specimen_labels) > 1
    names = case.specimen_labels if several else case.run_labels
    index = np.asarray(records.specimen if several else records.run)
    kind = "specimen " if several else "run "
    drawn = drawn_rows(np.asarray(records.force))
    x, y, group = (
        np.asarray(values)[drawn]
        for values in (records.deformation, records.force, index)
    )
    for place in np.unique(group):
        yield Points(
            label=f"{kind}{names[place]}" if len(names) > 1 else "",
            x=x[group == place],
            y=y[group == place],
            colour=CYCLE[place % len(CYCLE)],
        )


def _kept(found: Screening) -> Iterator[Points]:
    yield from _segments(found, found.kept, "o", "")


def left_out(found: Screening, segments: Iterable[int] = _DRAWN) -> Iterator[Points]:
    """Yield the rows that were left out, as crosses."""
    rows = ~found.kept & np.isin(found.segment, [*segments])
    yield from _segments(found, rows, "X", "left out: ")


def _segments(
    found: Screening, rows: np.ndarray, marker: str, words: str
) -> Iterator[Points]:
    """Yield some rows, those of each segment in its colour."""
    some = np.flatnonzero(rows)
    some = some[drawn_rows(found.force[some])]
    for segment in np.unique(found.segment[some]):
        these = some[found.segment[some] == segment]
        name = SEGMENTS[segment]
        yield Points(
            label=f"{words}{name}",
            x=found.deformation[these],
            y=found.force[these],
            colour=_COLOURS[name],
            marker=marker,
        )
