"""The figure of how far the gap shrinks: rung by rung, and on rows held out."""

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.diagnosis.verdict import Closure, Verdict
from hdcal.quantities import Quantities
from hdcal.report.axes import load_axis
from hdcal.report.canvas import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    ORANGE,
    heading,
    name_rows,
    note,
    plain,
    style,
    watermark,
)
from hdcal.report.words import hypothesis, load

# Above this ratio of first to second rung the others would be slivers.
_DWARFED = 8.0


def shrink_figure(verdict: Verdict) -> Figure:
    """Draw the ladder from the nominal model to the noise, and the held-out share."""
    shrink, units = verdict.shrink, verdict.case.units
    with style():
        figure = Figure(figsize=(7.6, 3.5), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
        _draw_ladder(left, shrink, units)
        _draw_closed(right, shrink, units)
        if verdict.status != "ok":
            watermark(figure)
    return figure


def _draw_ladder(axes: Axes, shrink: Closure, units: Quantities) -> None:
    heading(axes, "What is left, rung by rung")
    rungs = [r for r in shrink.ladder if np.isfinite(r.rms_N)]
    sizes = np.array([rung.rms_N for rung in rungs])
    if not len(rungs):
        _say(axes, shrink.reason or "not computed")
        return
    colours = [_colour(rung.model) for rung in rungs]
    axes.barh(range(len(rungs)), sizes, 0.66, color=colours)
    for place, size in enumerate(sizes):
        note(axes, load(float(size), units), (size, place), (3, 0), va="center")
        if place:
            line = {"color": GREY, "linewidth": 0.8, "linestyle": ":"}
            axes.plot([sizes[place - 1]] * 2, [place - 0.67, place - 0.33], **line)
    positive = sizes[sizes > 0.0]
    if len(sizes) > 1 and len(positive) and sizes[0] > _DWARFED * sizes[1]:
        axes.set_xscale("log")
        axes.set_xlim(0.5 * positive.min(), 4.0 * sizes.max())
        axes.xaxis.set_major_formatter("{x:g}")
    else:
        axes.set_xlim(0.0, 1.25 * sizes.max() or 1.0)
    name_rows(axes, [_rung(rung.model) for rung in rungs], size=8)
    axes.set_ylim(len(rungs) - 0.4, -0.6)
    axes.set_xlabel(load_axis(units, "measured − model, rms"))


def _colour(model: str) -> str:
    if model == "noise":
        return GREEN
    return GREY if model == "nominal" else ORANGE if model == "calibrated" else BLUE


def _rung(model: str) -> str:
    """Return a rung's name in short lines: `calibrated+a+b` is `+ a`, `+ b`."""
    first, *added = model.split("+")
    if "remainder" in added:  # it comes on top of the rung before
        added = ["remainder"]
    parts = [f"+ {hypothesis(name)}" for name in added] or [hypothesis(first)]
    return "\n".join(
        line for part in parts for line in textwrap.wrap(plain(part, 60), 18)
    )


def _draw_closed(axes: Axes, shrink: Closure, units: Quantities) -> None:
    heading(axes, "Share of the gap closed")
    if shrink.closed is None or not np.isfinite(shrink.closed.median):
        _say(axes, shrink.reason or "not computed")
        return
    rows = _rows(shrink, units)
    for place, (_, value, span, colour) in enumerate(reversed(rows)):
        if span is not None:
            axes.plot(span, [place, place], color=colour, linewidth=3.0, alpha=0.45)
        axes.plot(value, place, "o", color=colour, markersize=7)
    axes.axvline(0.0, color=DARK, linewidth=0.8)
    axes.axvline(1.0, color=GREEN, linewidth=0.8, linestyle="--")
    name_rows(axes, [row[0] for row in reversed(rows)], size=8)
    values = [end for _, value, span, _ in rows for end in (value, *(span or ()))]
    low = min(0.0, max(-1.0, min(values)))
    axes.set_xlim(low - 0.06, 1.08)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    ticks = [tick for tick in (-1.0, -0.5, 0.0, 0.5, 1.0) if tick >= low - 0.06]
    axes.set_xticks(ticks, [f"{100 * tick:.0f} %" for tick in ticks])


def _rows(shrink: Closure, units: Quantities) -> list[tuple]:
    """Return (words, value, interval or None, colour) of every mark, top first."""
    assert shrink.closed is not None
    closed = shrink.closed
    span = (closed.lo, closed.hi) if np.isfinite([closed.lo, closed.hi]).all() else None
    rows: list[tuple] = [("rows held out\n(95 % interval)", closed.median, span, BLUE)]
    bars = [(plain(hypothesis(n), 26), v) for n, v in shrink.bars.items()]
    if len(bars) > 1:
        rows += [
            (f"by {words}", value, None, ORANGE)
            for words, value in bars
            if np.isfinite(value)
        ]
    for words, value, colour in (
        (f"largest {units.displacement}s\nheld out", shrink.extrapolated_closed, BLUE),
        ("a free curve instead\n(placebo)", shrink.placebo_closed, GREY),
    ):
        if value is not None and np.isfinite(value):
            rows.append((words, value, None, colour))
    return rows


def _say(axes: Axes, words: str) -> None:
    axes.axis("off")
    text = "\n".join(textwrap.wrap(plain(words, 300), 34))
    axes.text(0.5, 0.5, text, ha="center", va="center", color=GREY)
