"""The figure of the residuals: what the fitted model leaves over."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.data.loading import movement_words
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals
from hdcal.report.canvas import (
    CYCLE,
    DARK,
    GREY,
    heading,
    plain,
    style,
    temperature_colours,
    thinned,
    watermark,
)

_MOST_GROUPS = 6


def residual_figure(posterior: Posterior, left: Residuals) -> Figure:
    """Draw standardised residuals over what they might depend on."""
    order = np.arange(1, len(left.residual) + 1)
    panels = [
        ("over deformation", "deformation as read [mm]", left.deformation),
        ("in the order of the rows", "row of the data", order),
    ]
    if np.ptp(left.temperature) > 0.0:
        panels.append(("over temperature", "temperature [°C]", left.temperature))
    with style():
        figure = Figure(figsize=(7.6, 2.5 * len(panels)), layout="constrained")
        rows = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
        groups = _groups(posterior, left)
        for axes, (words, unit, x) in zip(rows, panels, strict=True):
            _draw(axes, x, left.standardised, groups)
            heading(axes, f"Residuals {words}")
            axes.set_xlabel(unit)
            axes.set_ylabel("(measured − fit) / sd")
        if len(groups) > 1:
            rows[0].legend(
                loc="upper left",
                bbox_to_anchor=(1.0, 1.0),
                markerscale=2.0 if len(order) > 300 else 1.0,
            )
        if not posterior.usable:
            watermark(figure)
    return figure


def _groups(posterior: Posterior, left: Residuals) -> list[tuple]:
    """Return (words, rows, colour, marker): by temperature and direction, or by run."""
    warmth = np.round(left.temperature, 1)
    levels = np.unique(warmth)
    runs = np.unique(left.run)
    if len(levels) == 1 and 1 < len(runs) <= _MOST_GROUPS:
        kinds = [
            (
                plain(f"run {posterior.case.run_labels[run]}", 24),
                left.run == run,
                colour,
            )
            for run, colour in zip(runs, CYCLE, strict=False)
        ]
    elif 1 < len(levels) <= _MOST_GROUPS:
        shades = temperature_colours(levels)
        kinds = [
            (f"{level:g} °C", warmth == level, shade)
            for level, shade in zip(levels, shades, strict=True)
        ]
    else:
        kinds = [("", np.ones(len(warmth), dtype=bool), CYCLE[0])]
    groups = []
    both = len(np.unique(left.direction)) > 1
    ways = movement_words(left.deformation)
    for words, rows, colour in kinds:
        for sense, mark in ((1, "^"), (-1, "v")):
            here = rows & (left.direction == sense)
            if here.any():
                text = ", ".join(filter(None, (words, ways[sense] if both else "")))
                groups.append((text, here, colour, mark))
    return groups


def _draw(axes: Axes, x, values, groups) -> None:
    shown = np.zeros(len(values), dtype=bool)
    shown[thinned(len(values))] = True
    # The largest ones are what a reader looks for: never thin them out.
    shown[np.argsort(-np.abs(values))[:50]] = True
    small = np.count_nonzero(shown) > 300
    axes.axhspan(-2.0, 2.0, color=GREY, alpha=0.14, linewidth=0.0, zorder=0)
    axes.axhline(0.0, color=DARK, linewidth=0.8)
    for words, rows, colour, mark in groups:
        here = rows & shown
        axes.plot(
            x[here],
            values[here],
            mark,
            label=words,
            color=colour,
            markersize=2.5 if small else 5.0,
            markeredgecolor="none" if small else "white",
            markeredgewidth=0.5,
            alpha=0.5 if small else 1.0,
            rasterized=small,
        )
    reach = max(3.0, 1.1 * float(np.max(np.abs(values))))
    axes.set_ylim(-reach, reach)
    # Above the panel: inside it, it would cover readings.
    axes.set_title("grey: ±2 sd", loc="right", fontsize=8, color=GREY)
