"""The figure of where the gap lies: residuals, cells, and what adds up."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hdcal.diagnosis.chart import running_sums
from hdcal.diagnosis.gap import Cell
from hdcal.diagnosis.verdict import Verdict
from hdcal.quantities import Quantities
from hdcal.report.axes import covariate_axis, load_axis
from hdcal.report.canvas import (
    BLUE,
    DARK,
    GREY,
    ORANGE,
    RED,
    heading,
    name_rows,
    plain,
    style,
    thinned,
    watermark,
)

_MOST_LABELS = 10
_LIGHT = "#b9c2ca"


def where_figure(verdict: Verdict) -> Figure:
    """Draw the residuals of the calibrated model and the cells that they fall in."""
    scales, labels = verdict.where.by_covariate()
    with style():
        figure, first, others, last = _panels(scales, labels)
        for axes, (covariate, cells) in zip(
            [first, *others[: len(scales) - 1]], scales.items(), strict=True
        ):
            _draw_scale(axes, verdict, covariate, cells)
        for axes, (covariate, cells) in zip(
            others[len(scales) - 1 :], labels.items(), strict=True
        ):
            _draw_labels(axes, covariate, cells, verdict.case.units)
        _draw_sums(last, verdict)
        _legend(first, verdict)
        if verdict.status != "ok":
            watermark(figure)
    return figure


def _panels(scales: dict, labels: dict) -> tuple[Figure, Axes, list[Axes], list[Axes]]:
    """Return deformation over the whole width, the others in pairs where they fit."""
    narrow = [name for name in [*scales, *labels][1:] if "×" not in name]
    wide = [name for name in labels if "×" in name]
    counts = {name: min(len(cells), _MOST_LABELS) for name, cells in labels.items()}
    rows = [narrow[i : i + 2] for i in range(0, len(narrow), 2)]
    rows += [[name] for name in wide]
    tall = [max(0.9 + 0.22 * counts.get(name, 6) for name in row) for row in rows]
    heights = [3.1, *tall, 2.3]
    figure = Figure(figsize=(7.6, sum(heights)), layout="constrained")
    # Each row is laid out by itself: long labels of one do not narrow the others.
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)
    top, *middle, bottom = parts[:, 0]
    others = [
        axes
        for part, row in zip(middle, rows, strict=True)
        for axes in part.subplots(1, len(row), squeeze=False)[0]
    ]
    return figure, top.subplots(), others, list(bottom.subplots(1, 2))


def _draw_scale(axes: Axes, verdict: Verdict, name: str, cells: list[Cell]) -> None:
    values = verdict.where.values_of(name)
    residual = verdict.where.residual_N
    rows = thinned(len(residual))
    axes.axhline(0.0, color=DARK, linewidth=0.8)
    if values is not None:
        # Many readings are a cloud, few are points.
        size, colour = (4.5, GREY) if len(rows) < 60 else (3.5, _LIGHT)
        size = 2.0 if len(rows) > 300 else size
        dots = {"color": colour, "markersize": size, "markeredgewidth": 0.0}
        axes.plot(values[rows], residual[rows], "o", rasterized=len(rows) > 300, **dots)
    if name == "deformation" and values is not None:
        _draw_gap(axes, values, verdict.where.gap_N)
    ends = [end for cell in cells for end in (cell.from_, cell.to)]
    thin = 0.02 * (max(ends) - min(ends) or 1.0) if ends else 0.0
    for cell in cells:
        start, stop = cell.from_, cell.to
        if stop - start < thin:
            start, stop = start - thin, stop + thin
        _draw_cell(axes, cell, start, stop)
    units = verdict.case.units
    heading(axes, f"Over {units.name(name)}")
    axes.set_xlabel(covariate_axis(name, cells[0].unit if cells else "mm", units))
    axes.set_ylabel(load_axis(units, "measured − model"))


def _draw_cell(axes: Axes, cell: Cell, start: float, stop: float) -> None:
    if cell.hot:
        axes.axvspan(start, stop, color=ORANGE, alpha=0.16, linewidth=0.0, zorder=0)
    width = _half_width(cell)
    axes.fill_between(
        [start, stop], -width, width, color=BLUE, alpha=0.16, linewidth=0.0, zorder=1
    )
    colour = RED if cell.hot else BLUE
    bias = [cell.bias_N.median] * 2
    line = {"linewidth": 2.2, "solid_capstyle": "butt"}
    axes.plot([start, stop], bias, color=colour, zorder=4, **line)


def _half_width(cell: Cell) -> float:
    return cell.bias_N.hi - cell.bias_N.median


def _draw_gap(axes: Axes, deformation: np.ndarray, gap: np.ndarray) -> None:
    # The gap has a memory: joined in the order of the rows a loop stays a loop.
    if len(gap) > 2000:
        rows = thinned(len(gap))
        axes.plot(deformation[rows], gap[rows], ".", color=DARK, markersize=1.5)
    else:
        axes.plot(deformation, gap, color=DARK, linewidth=0.9, zorder=3)


def _draw_labels(
    axes: Axes, covariate: str, cells: list[Cell], units: Quantities
) -> None:
    chosen = sorted(cells, key=lambda cell: -abs(cell.z))[:_MOST_LABELS]
    # In the order of the cells, the first one on top.
    shown = [cell for cell in cells if cell in chosen][::-1]
    for place, cell in enumerate(shown):
        if cell.hot:
            axes.axhspan(
                place - 0.5, place + 0.5, color=ORANGE, alpha=0.16, linewidth=0.0
            )
        width, colour = _half_width(cell), RED if cell.hot else BLUE
        axes.barh(place, 2.0 * width, 0.62, left=-width, color=BLUE, alpha=0.16)
        bias = [cell.bias_N.median] * 2
        axes.plot(bias, [place - 0.31, place + 0.31], color=colour, lw=2.2)
    axes.use_sticky_edges = False
    axes.axvline(0.0, color=DARK, linewidth=0.8)
    name_rows(axes, [plain(cell.label, 34) for cell in shown], size=8)
    axes.set_ylim(-0.6, len(shown) - 0.4)
    more = f" (worst {len(shown)} of {len(cells)})" if len(shown) < len(cells) else ""
    heading(axes, f"By {plain(units.name(covariate), 40)}{more}")
    axes.set_xlabel(load_axis(units, "measured − model"))


def _draw_sums(panels: list[Axes], verdict: Verdict) -> None:
    """Draw running sums: noise wanders, a gap keeps its course."""
    for axes, (text, x, total, reach) in zip(
        panels, running_sums(verdict), strict=True
    ):
        axes.axhline(0.0, color=DARK, linewidth=0.8)
        if math.isfinite(reach):
            axes.axhspan(-reach, reach, color=GREY, alpha=0.14, linewidth=0.0)
        axes.plot(x, total, color=BLUE, linewidth=1.3)
        axes.set_xlabel(text)
    units = verdict.case.units
    panels[0].set_ylabel(load_axis(units, "running sum"))
    heading(panels[0], f"Running sum over {units.displacement}")
    heading(panels[1], "Running sum, row by row")


def _legend(axes: Axes, verdict: Verdict) -> None:
    handles = [
        Line2D([], [], color=_LIGHT, marker="o", linestyle="", markersize=4),
        Line2D([], [], color=BLUE, linewidth=2.2),
        Patch(color=BLUE, alpha=0.16, linewidth=0),
        Line2D([], [], color=DARK, linewidth=0.9),
    ]
    texts = ["reading", "mean of a range", "what noise alone leaves (95 %)", "gap"]
    if any(cell.hot for cell in verdict.where.cells):
        handles.append(Line2D([], [], color=RED, linewidth=2.2))
        texts.append("off")
    axes.legend(
        handles,
        texts,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.07),
        ncols=len(texts),
        columnspacing=1.2,
        handlelength=1.4,
    )
