"""Charts of a diagnosis: where the gap lies, which effects act, how far it closes."""

from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.case import Case
from hdcal.data.loading import movement_words
from hdcal.diagnosis.gap import GapByRow
from hdcal.diagnosis.which import Which, either
from hdcal.evidence.row_features import half_cycles
from hdcal.quantities import Quantities
from hdcal.report.charts.axes import displacement_axis, load_axis
from hdcal.report.charts.chart_spec import (
    BLUE,
    ORANGE,
    Band,
    Bars,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
    drawn_rows,
)
from hdcal.report.item import INTERVAL

if TYPE_CHECKING:
    from hdcal.diagnosis.result import HowFar

# Classes that are shown, and the least probability of one.
_MOST, _LEAST = 8, 0.01
# With more half cycles than this bands would cover each other: medians stay.
_MOST_BANDS = 40
_COLOURS = {1: BLUE, -1: ORANGE}
# What the formula leaves hides the rest of the ladder, and stays in the table.
FORMULA = "formula with K = 1"


def gap_chart(case: Case, rows: GapByRow) -> Chart:
    """Return residuals over deformation with the posterior of the gap as bands."""
    records, points, bands, lines = rows.records, list[Mark](), list[Mark](), []
    x, sense = np.asarray(records.deformation), np.asarray(records.sense)
    words = movement_words(x, case.units.displacement)
    # As read again, not from contact.
    x = x + case.gear.contact
    drawn = drawn_rows(rows.residual)
    turns = np.flatnonzero(np.diff(half_cycles(records))) + 1
    halves = np.split(np.arange(len(x)), turns)
    for way, colour in _COLOURS.items():
        here = sense == way
        if not here.any():
            continue
        some = drawn[here[drawn]]
        points.append(
            Points(label=words[way], x=x[some], y=rows.residual[some], colour=colour)
        )
        some = [half for half in halves if here[half[0]] and len(half) > 1]
        # One entry of the legend is enough for all half cycles.
        names = [f"gap, {words[way]}", *[""] * len(some)]
        for name, half in zip(names, some, strict=False):
            band, line = _gap(x, rows.draws, half, name, colour, len(some))
            lines.append(line)
            if len(some) <= _MOST_BANDS:
                bands.append(band)
    panel = Panel(
        x=displacement_axis(case),
        y=load_axis(case.units, "measured − model"),
        marks=[Rule(at=0.0), *bands, *points, *lines],
        title=f"{case.name}: residuals of the straight model",
        wide=True,
        height=4.0,
        legend_beside=True,
    )
    return Chart(panels=[panel])


def _gap(
    x: np.ndarray,
    draws: np.ndarray,
    half: np.ndarray,
    name: str,
    colour: str,
    count: int,
) -> tuple[Band, Line]:
    """Return interval and median of the gap over the rows of a half cycle.

    Bands of many half cycles, `count`, lie over each other: each is paler.
    """
    rows = half[np.argsort(x[half], kind="stable")]
    tail = (1.0 - INTERVAL) / 2.0
    low, middle, high = np.quantile(draws[:, rows], [tail, 0.5, 1.0 - tail], axis=0)
    band = Band(
        label=name,
        x=x[rows],
        low=low,
        high=high,
        colour=colour,
        opacity=max(0.35 / np.sqrt(count), 0.08),
    )
    return band, Line(label=name, x=x[rows], y=middle, colour=colour, width=0.8)


def which_chart(which: Which) -> Chart:
    """Return the probability of each class of effects, and of anything else."""
    shown = [c for c in which.causes if c.probability >= _LEAST][:_MOST]
    named = {either(cause.members): cause.probability for cause in shown}
    named["outside the library"] = which.outside.probability
    return _ranked("probability that the effect acts", named)


def _ranked(axis: str, named: dict[str, float]) -> Chart:
    """Return bars with room for long names."""
    names, high = [*named], np.array([*named.values()])
    bars = Bars(at=np.arange(1.0, len(names) + 1.0), high=high, colour=BLUE)
    lines = max((len(wrap(name, 40)) for name in names), default=1)
    panel = Panel(
        x="",
        y=axis,
        marks=[bars],
        names=names,
        horizontal=True,
        y_limits=(0.0, None),
        wide=True,
        height=1.0 + (0.2 + 0.15 * lines) * max(len(names), 2),
    )
    return Chart(panels=[panel])


def ladder_chart(far: "HowFar", units: Quantities) -> Chart:
    """Return what each model leaves, from the straight model to the noise."""
    rungs = {rung.model: rung.rms_N for rung in far.ladder if rung.model != FORMULA}
    return _ranked(load_axis(units, "root mean square of the residuals"), rungs)
