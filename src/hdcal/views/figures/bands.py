"""The figure of a calibration: what was measured, and the bands around it."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hdcal.answers.bands import Bands
from hdcal.answers.residuals import Residuals
from hdcal.inference.posterior import Posterior
from hdcal.views.figures.canvas import (
    DARK,
    GREY,
    MOST_POINTS,
    heading,
    plain,
    style,
    temperature_colours,
    thinned,
    watermark,
)

_MARKS = {1: "^", -1: "v"}
_SENSE = {"up": 1, "down": -1}


def calibration_figure(posterior: Posterior, bands: Bands, left: Residuals) -> Figure:
    """Draw force over deformation, and below it the distance from the fit.

    Args:
        posterior: names, status.
        bands: from `default_bands`.
        left: residuals of the same posterior.
    """
    gear = posterior.case.gear
    levels = np.unique(bands.temperature_C)
    colours = temperature_colours(levels)
    with style():
        figure = Figure(figsize=(7.6, 7.4), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.9, 1.0])
        for rows in _curves(bands):
            level = int(np.searchsorted(levels, bands.temperature_C[rows][0]))
            _draw_curve(top, bands, rows, colours[level], baseline=False)
            _draw_curve(below, bands, rows, colours[level], baseline=True)
        _draw_points(top, left, left.measured, levels, colours)
        _draw_points(below, left, _distance(bands, left), levels, colours)
        below.axhline(0.0, color=DARK, linewidth=0.8, zorder=1)
        heading(top, f"{plain(gear.name)}: force as read")
        heading(below, "Distance from the fit")
        top.set_ylabel("force [N]")
        below.set_ylabel("force − fit [N]")
        below.set_xlabel(f"deformation as read ({gear.reading}) [mm]")
        _limit(below, bands, left)
        _legend(top, bands, left, levels, colours)
        if not posterior.usable:
            watermark(figure)
    return figure


def _distance(bands: Bands, left: Residuals) -> np.ndarray:
    """Return how far each reading is from the force model alone [N]."""
    if not np.isfinite(bands.with_gap_median_N).any():
        return left.residual
    # The residuals are what the discrepancy leaves over too; it knows deformation only.
    rows = next(_curves(bands))
    leftover = (bands.with_gap_median_N - bands.physics_median_N)[rows]
    x = left.deformation
    return left.residual + np.interp(x, bands.deformation_mm[rows], leftover)


def _curves(bands: Bands) -> Iterator[np.ndarray]:
    """Yield the rows of each temperature and direction."""
    for temperature in np.unique(bands.temperature_C):
        for direction in dict.fromkeys(bands.direction.tolist()):
            found = (bands.temperature_C == temperature) & (
                bands.direction == direction
            )
            if found.any():
                yield np.flatnonzero(found)


def _draw_curve(axes: Axes, bands: Bands, rows, colour: str, *, baseline: bool) -> None:
    x = bands.deformation_mm[rows]
    zero = bands.physics_median_N[rows] if baseline else np.zeros(len(rows))
    tested = np.asarray(bands.tested[rows], dtype=bool)
    dashes = (0, (4, 2)) if bands.direction[rows[0]] == "down" else "-"
    # Neighbouring stretches share a point, else a white slit opens between them.
    beyond = ~tested | np.append(~tested[1:], False) | np.append(False, ~tested[:-1])
    bands_here = [("new_measurement", 0.16), ("physics", 0.38)]
    if np.isfinite(bands.with_gap_median_N).any():
        bands_here.insert(1, ("with_gap", 0.22))
    for name, strength in bands_here:
        low = getattr(bands, f"{name}_lo_N")[rows] - zero
        high = getattr(bands, f"{name}_hi_N")[rows] - zero
        shade = {"color": colour, "linewidth": 0.0}
        axes.fill_between(x, low, high, where=tested, alpha=strength, **shade)
        axes.fill_between(x, low, high, where=beyond, alpha=strength / 3, **shade)
        if name == "new_measurement":
            edge = {"facecolor": "none", "edgecolor": colour, "linewidth": 0.0}
            axes.fill_between(
                x, low, high, where=beyond, hatch="////", alpha=0.45, **edge
            )
    middle = bands.physics_median_N[rows] - zero
    axes.plot(x, np.where(tested, middle, np.nan), color=colour, linestyle=dashes)
    axes.plot(x, np.where(beyond, middle, np.nan), color=colour, linestyle=":")
    if len(bands_here) == 3:
        gap = bands.with_gap_median_N[rows] - zero
        axes.plot(x, gap, color=colour, linewidth=1.0, linestyle="-.")


def _draw_points(axes: Axes, left: Residuals, values, levels, colours) -> None:
    shown = thinned(len(values))
    nearest = np.argmin(np.abs(left.temperature[:, None] - levels), axis=1)
    small = len(values) > 300
    for sense, mark in _MARKS.items():
        for index, colour in enumerate(colours):
            rows = shown[(nearest[shown] == index) & (left.direction[shown] == sense)]
            axes.plot(
                left.deformation[rows],
                values[rows],
                mark,
                markersize=2.5 if small else 5.0,
                markerfacecolor=colour,
                markeredgecolor="white" if not small else "none",
                markeredgewidth=0.5,
                alpha=0.5 if small else 1.0,
                zorder=4,
                rasterized=len(shown) > 1000,
            )


def _limit(axes: Axes, bands: Bands, left: Residuals) -> None:
    """Let the bands inside the tested range and the data fill the lower panel."""
    inside = np.asarray(bands.tested, dtype=bool)
    middle = bands.physics_median_N
    edges = [_distance(bands, left)]
    for name in ("new_measurement_lo_N", "new_measurement_hi_N"):
        edges.append((getattr(bands, name) - middle)[inside])
    reach = 1.12 * np.max(np.abs(np.concatenate(edges)))
    if np.isfinite(reach) and reach > 0.0:
        axes.set_ylim(-reach, reach)


def _legend(axes: Axes, bands: Bands, left: Residuals, levels, colours) -> None:
    main = colours[0] if len(colours) == 1 else GREY
    handles: list = []
    texts: list[str] = []

    def add(handle, text: str) -> None:
        handles.append(handle)
        texts.append(text)

    size = len(left.measured)
    note = f" ({MOST_POINTS} of {size} drawn)" if size > MOST_POINTS else ""
    both = len(np.unique(left.direction)) > 1
    for sense, mark in _MARKS.items():
        if np.any(left.direction == sense):
            word = "loading" if sense > 0 else "unloading"
            style_ = {"marker": mark, "linestyle": "", "color": main, "markersize": 5}
            add(Line2D([], [], **style_), f"measured, {word}{note}")
    line = Line2D([], [], color=main)
    add(
        (Patch(color=main, alpha=0.55, linewidth=0), line), "force model, 95 % credible"
    )
    if both:
        dashed = Line2D([], [], color=main, linestyle=(0, (4, 2)))
        add(dashed, "force model, unloading")
    if np.isfinite(bands.with_gap_median_N).any():
        line = Line2D([], [], color=main, linestyle="-.", linewidth=1.0)
        patch = Patch(color=main, alpha=0.35, linewidth=0)
        add((patch, line), "with the leftover discrepancy, 95 %")
    add(Patch(color=main, alpha=0.2, linewidth=0), "one new reading, 95 %")
    if not np.all(bands.tested):
        hatch = Patch(facecolor="none", edgecolor=main, hatch="////", linewidth=0)
        dots = Line2D([], [], color=main, linestyle=":")
        add((hatch, dots), "not tested: extrapolated")
    if len(levels) > 1:
        for level, colour in zip(levels, colours, strict=True):
            add(Patch(color=colour, linewidth=0), f"{level:g} °C")
    combined = {tuple: HandlerTuple(ndivide=1)}
    axes.legend(handles, texts, loc="upper left", handler_map=combined)
