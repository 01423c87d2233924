"""Charts of a diagnosis: where the gap lies, which effects act, how far it closes."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.case import Case
from hdcal.data.loading import movement_words
from hdcal.explanation.gap import GapByRow
from hdcal.quantities import Quantities
from hdcal.report.axes import displacement_axis, load_axis
from hdcal.report.chart_spec import (
    BLUE,
    GREY,
    ORANGE,
    Band,
    Bars,
    Chart,
    Mark,
    Panel,
    Points,
    Rule,
    drawn_rows,
)
from hdcal.report.item import INTERVAL
from hdcal.report.words import label

if TYPE_CHECKING:
    from hdcal.explanation.result import HowFar, Which

# Bins of the deformation in which the band of the gap is drawn, classes that are shown,
# and the least probability of one.
_BINS, _MOST, _LEAST = 12, 8, 0.01
_COLOURS = {1: BLUE, -1: ORANGE}


def gap_chart(case: Case, rows: GapByRow) -> Chart:
    """Return residuals over deformation with the posterior of the gap as a band."""
    records, marks = rows.records, list[Mark]()
    x, sense = np.asarray(records.deformation), np.asarray(records.sense)
    words = movement_words(x, case.units.displacement)
    drawn = drawn_rows(rows.residual)
    for way, colour in _COLOURS.items():
        here = sense == way
        if not here.any():
            continue
        some = drawn[here[drawn]]
        marks.append(
            Points(label=words[way], x=x[some], y=rows.residual[some], colour=colour)
        )
        marks += _band(x[here], rows.draws[:, here], f"gap, {words[way]}", colour)
    panel = Panel(
        x=displacement_axis(case),
        y=load_axis(case.units, "measured − model"),
        marks=[*marks, Rule(at=0.0)],
        title=f"{case.name}: what the straight model leaves",
        wide=True,
        height=4.0,
        legend_beside=True,
    )
    return Chart(panels=[panel])


def _band(x: np.ndarray, draws: np.ndarray, words: str, colour: str) -> Iterator[Band]:
    """Yield the interval of the gap's mean in ranges of the deformation."""
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, min(_BINS, x.size) + 1)))
    if edges.size < 3:
        return
    place = np.clip(np.searchsorted(edges, x, "right") - 1, 0, edges.size - 2)
    count = np.bincount(place, minlength=edges.size - 1)
    mean = np.stack([np.bincount(place, row, edges.size - 1) for row in draws])
    kept = count > 0
    tail = (1.0 - INTERVAL) / 2.0
    low, high = np.quantile(mean[:, kept] / count[kept], [tail, 1.0 - tail], axis=0)
    middle = (0.5 * (edges[1:] + edges[:-1]))[kept]
    yield Band(label=words, x=middle, low=low, high=high, colour=colour)


def which_chart(which: "Which") -> Chart:
    """Return the probability of each class of effects."""
    shown = [c for c in which.causes if c.probability >= _LEAST][:_MOST]
    names = [_names(each.members) for each in shown] + ["outside the library"]
    chances = [each.probability for each in (*shown, which.outside)]
    bars = Bars(at=np.arange(1.0, len(names) + 1.0), high=np.array(chances))
    panel = Panel(
        x="",
        y="probability that it acts",
        marks=[bars],
        names=names,
        horizontal=True,
        y_limits=(0.0, 1.0),
        wide=True,
    )
    return Chart(panels=[panel])


def _names(members: tuple[str, ...]) -> str:
    first = " or ".join(map(label, members[:2]))
    return f"{first} or {len(members) - 2} more" if len(members) > 2 else first


def ladder_chart(far: "HowFar", units: Quantities) -> Chart:
    """Return what each model leaves of the readings, from the formula to the noise."""
    rms = np.array([rung.rms_N for rung in far.ladder])
    at = np.arange(1.0, len(rms) + 1.0)
    panel = Panel(
        x="",
        y=load_axis(units, "root mean square of what is left"),
        marks=[
            Bars(at=at[:-1], high=rms[:-1]),
            Bars(at=at[-1:], high=rms[-1:], colour=GREY),
        ],
        names=[rung.model for rung in far.ladder],
        horizontal=True,
        wide=True,
    )
    return Chart(panels=[panel])
