"""The figures of a blind check: the bar, who is taken for whom, and how sure."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.blind.scoring.bar import BarResult
from hdcal.blind.scoring.detection import DetectionCurve
from hdcal.blind.scoring.reliability import Reliabilities, Reliability
from hdcal.blind.scoring.tables import Confusion
from hdcal.blind.words import truth_word
from hdcal.report.canvas import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    ORANGE,
    RED,
    heading,
    plain,
    style,
)
from hdcal.report.words import hypothesis

# Narrow, so that a phone need not shrink the letters much.
_WIDTH = 5.2
_SHARES = ("share", "points")
# Most distances and errors lie inside; a rare large one must not squeeze the others.
_EDGES = (-0.1, 1.05)


def bar_figure(rows: Sequence[BarResult]) -> Figure:
    """Draw every row of the bar with its interval against its target."""
    shares = [r for r in rows if r.unit in _SHARES and r.value is not None]
    others = [r for r in rows if r.unit not in _SHARES and r.value is not None]
    with style():
        height = 1.5 + 0.4 * (len(shares) + len(others))
        figure = Figure(figsize=(_WIDTH, height), layout="constrained")
        ratios = [len(shares) + 1.5, len(others) + 1.5]
        upper, lower = figure.subplots(2, 1, height_ratios=ratios)
        _draw_rows(upper, [_cut(row) for row in shares], "Shares and errors")
        ticks = [0.0, 0.25, 0.5, 0.75, 1.0]
        upper.set_xticks(ticks, [f"{100 * tick:.0f} %" for tick in ticks])
        upper.set_xlim(*_EDGES)
        _draw_rows(lower, others, "On their own scales")
        ends = [end or 0.0 for row in others for end in (row.value, row.hi)]
        lower.set_xlim(-0.06, max(2.1, *ends, 0.0) * 1.03)
    return figure


def _cut(row: BarResult) -> BarResult:
    """Return a row whose numbers stay in the panel; past it they stand at its edge."""

    def inside(end: float | None) -> float | None:
        return None if end is None else min(max(end, low), high)

    low, high = _EDGES[0] + 0.02, _EDGES[1] - 0.02
    return replace(row, value=inside(row.value), lo=inside(row.lo), hi=inside(row.hi))


def _draw_rows(axes: Axes, rows: Sequence[BarResult], words: str) -> None:
    heading(axes, words)
    if not rows:
        _say(axes, "no cases")
        return
    for place, row in enumerate(rows):
        colour = {True: BLUE, False: RED, None: GREY}[row.met]
        if row.target is not None:
            _draw_target(axes, place, row)
        if row.lo is not None:
            ends = _floats(row.lo, row.hi)
            axes.plot(ends, [place] * 2, color=colour, linewidth=2.4, alpha=0.55)
        mark = {True: "o", False: "X", None: "D"}[row.met]
        axes.plot(_floats(row.value), place, mark, color=colour, markersize=6.5)
    axes.set_yticks(range(len(rows)), [_wrapped(r.what, 31) for r in rows])
    axes.tick_params(axis="y", labelsize=7.5, length=0)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(False, axis="y")


def _floats(*values: float | None) -> np.ndarray:
    return np.array(values, dtype=float)


def _draw_target(axes: Axes, place: int, row: BarResult) -> None:
    ends = np.atleast_1d(np.array(row.target, dtype=float))
    low = -50.0 if row.direction == "at most" else ends[0]
    high = 50.0 if row.direction == "at least" else ends[-1]
    # Past the edge of the panel, where limits that are set by hand cut it off.
    axes.fill_betweenx(
        [place - 0.36, place + 0.36], low, high, color=GREEN, alpha=0.16, linewidth=0
    )
    for end in ends:
        line = {"color": GREEN, "linewidth": 1.4}
        axes.plot([end, end], [place - 0.36, place + 0.36], **line)


def confusion_figure(table: Confusion) -> Figure:
    """Draw how often each truth got each hypothesis as the most probable one."""
    counts = np.array(table.counts, dtype=float)
    truths, answers = table.truths, table.answers
    with style():
        size = (_WIDTH + 0.1 * len(answers), 1.6 + 0.24 * len(truths))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        if not counts.size:
            _say(axes, "no cases")
            return figure
        total = counts.sum(axis=1, keepdims=True)
        share = counts / np.maximum(total, 1.0)
        axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        for (row, column), n in np.ndenumerate(counts):
            if n:
                ink = "white" if share[row, column] > 0.55 else DARK
                place = {"ha": "center", "va": "center", "fontsize": 7}
                axes.text(column, row, f"{n:.0f}", color=ink, **place)
        _name_cells(axes, truths, answers)
    return figure


def _name_cells(axes: Axes, truths: list[str], answers: list[str]) -> None:
    words = [_wrapped(truth_word(name), 30) for name in truths]
    axes.set_yticks(range(len(truths)), words)
    shown = [plain(truth_word(name), 28) for name in answers]
    axes.set_xticks(range(len(answers)), shown, rotation=90)
    axes.tick_params(labelsize=7.5, length=0)
    axes.set_xlabel("most probable answer")
    axes.set_ylabel("truth")
    axes.set_xticks(np.arange(len(answers) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(truths) + 1) - 0.5, minor=True)
    axes.grid(False, which="major")
    axes.grid(True, which="minor", color="#e6e6e6", linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    for row, name in enumerate(truths):
        # Framed: where a right answer stands.
        right = {"withheld": "unknown", "outside": "unknown"}.get(name, name)
        if right in answers and name != "real":
            corner = (answers.index(right) - 0.5, row - 0.5)
            _frame(axes, corner)


def _frame(axes: Axes, corner: tuple[float, float]) -> None:
    x, y = corner
    around = [x, x + 1, x + 1, x, x], [y, y, y + 1, y + 1, y]
    axes.plot(*around, color=ORANGE, linewidth=1.2, clip_on=False)


def _wrapped(text: str, width: int) -> str:
    return "\n".join(textwrap.wrap(plain(text, 80), width))


def _say(axes: Axes, words: str) -> None:
    axes.axis("off")
    axes.text(0.5, 0.5, words, ha="center", va="center", color=GREY)


def reliability_figure(found: Reliabilities) -> Figure:
    """Draw what was stated against how often it was true."""
    with style():
        figure = Figure(figsize=(_WIDTH, 2.85), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        _draw_reliability(left, found.top, "Most probable hypothesis")
        _draw_reliability(right, found.effects, "Every effect given 5 % or more")
        left.set_ylabel("true")
    return figure


def _draw_reliability(axes: Axes, table: Reliability, words: str) -> None:
    axes.set_title(words, loc="left", fontweight="bold", color=DARK, fontsize=8.5)
    axes.plot([0, 1], [0, 1], color=GREEN, linewidth=1.0, linestyle="--")
    for row in table.bins:
        axes.plot([row.stated] * 2, _floats(row.lo, row.hi), color=BLUE, alpha=0.5)
        axes.plot(row.stated, _floats(row.true), "o", color=BLUE, markersize=5)
    ticks = [0.0, 0.25, 0.5, 0.75, 1.0]
    texts = ["0", "25", "50", "75", "100 %"]
    axes.set_xticks(ticks, texts)
    axes.set_yticks(ticks, texts)
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.set_aspect("equal")
    axes.set_xlabel("stated")
    if not table.bins:
        axes.text(0.5, 0.3, "no cases", ha="center", color=GREY)


def detection_figure(curves: Sequence[DetectionCurve]) -> Figure:
    """Draw the fraction detected against the size of the gap, effect by effect."""
    columns = 3
    rows = max(1, -(-len(curves) // columns))
    with style():
        figure = Figure(figsize=(_WIDTH, 0.5 + 1.35 * rows), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in panels.ravel()[len(curves) :]:
            axes.axis("off")
        if not curves:
            _say(panels[0, 1], "no cases")
        for place, (axes, curve) in enumerate(
            zip(panels.ravel(), curves, strict=False)
        ):
            _draw_detection(axes, curve)
            # The last panel of a column need not stand in the last row.
            axes.tick_params(labelbottom=place + columns >= len(curves))
        figure.supxlabel("gap over noise, r", fontsize=9)
        figure.supylabel("detected", fontsize=9)
    return figure


def _draw_detection(axes: Axes, curve: DetectionCurve) -> None:
    fitted = curve.curve
    band = {"color": BLUE, "alpha": 0.2, "linewidth": 0}
    axes.fill_between(fitted.r, fitted.lo, fitted.hi, **band)
    axes.plot(fitted.r, fitted.fraction, color=BLUE, linewidth=1.4)
    for point in curve.points:
        axes.plot([point.r] * 2, _floats(point.lo, point.hi), color=GREY, lw=0.9)
        axes.plot(point.r, _floats(point.value), "o", color=DARK, markersize=3)
    if curve.r90 is not None:
        axes.axvline(curve.r90, color=ORANGE, linewidth=1.2, linestyle="--")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_ylim(-0.05, 1.05)
    axes.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    axes.tick_params(labelsize=7.5)
    words = _wrapped(hypothesis(curve.effect), 22)
    axes.set_title(words, loc="left", fontsize=8, color=DARK)
