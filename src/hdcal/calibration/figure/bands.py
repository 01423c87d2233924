"""The figure of a calibration: what was measured, and the bands around it."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hdcal.data.loading import loading_side, movement_words
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals
from hdcal.prediction.bands.bands import Bands
from hdcal.report.canvas import (
    DARK,
    GREY,
    MOST_DRAWN,
    beyond,
    heading,
    plain,
    style,
    temperature_colours,
    thinned,
    watermark,
)

_MARKS = {1: "^", -1: "v"}
_DASHES = (0, (4, 2))
_MOST_COLUMNS = 3


def calibration_figure(posterior: Posterior, bands: Bands, left: Residuals) -> Figure:
    """Draw force over deformation, and below it the distance from the fit."""
    gear = posterior.case.gear
    levels = np.unique(bands.temperature_C)
    colours = temperature_colours(levels)
    solid = "down" if loading_side(left.deformation) < 0 else "up"
    gap = posterior.problem.discrepancy
    looped = gap is not None and gap.looped
    with style():
        figure, top, panels = _panels(len(levels))
        for rows in reversed(list(_curves(bands))):
            level = int(np.searchsorted(levels, bands.temperature_C[rows][0]))
            strength = 1.0 / np.sqrt(len(levels))
            line = "-" if bands.direction[rows[0]] == solid else _DASHES
            _draw_curve(top, bands, rows, colours[level], line, strength)
            # Around its own median unloading has the same bands as loading, unless
            # the leftover tells them apart.
            if looped or bands.direction[rows[0]] == bands.direction[0]:
                of = panels[level], bands, rows, colours[level], line
                _draw_curve(*of, baseline=True)
        distance = distance_from_model(bands, left)
        nearest = np.argmin(np.abs(left.temperature[:, None] - levels), axis=1)
        for index, (axes, level) in enumerate(zip(panels, levels, strict=True)):
            here = nearest == index
            _draw_points(top, left, left.measured, here, colours[index])
            _draw_points(axes, left, distance, here, colours[index])
            axes.axhline(0.0, color=DARK, linewidth=0.8, zorder=1)
            # Beside each other there is room for a temperature, and not for more.
            alone = len(levels) == 1
            heading(axes, "Distance from the fit" if alone else f"at {level:g} °C")
        heading(top, f"{plain(gear.name)}: force as read")
        top.set_ylabel("force [N]")
        panels[0].set_ylabel("distance from the fit [N]")
        _limit(panels[0], bands, distance)
        figure.supxlabel(f"deformation as read ({gear.reading}) [mm]", fontsize=10)
        _legend(top, bands, left, levels, colours, solid)
        if not posterior.usable:
            watermark(figure)
    return figure


def _panels(count: int) -> tuple[Figure, Axes, list[Axes]]:
    """Return a large panel above one small panel per temperature."""
    columns = min(count, _MOST_COLUMNS)
    rows = -(-count // columns)
    figure = Figure(figsize=(7.6, 5.0 + 2.3 * rows), layout="constrained")
    grid = figure.add_gridspec(1 + rows, columns, height_ratios=[2.0] + [1.0] * rows)
    top = figure.add_subplot(grid[0, :])
    panels: list[Axes] = []
    for index in range(count):
        place = grid[1 + index // columns, index % columns]
        first = panels[0] if panels else None
        panels.append(figure.add_subplot(place, sharex=first, sharey=first))
        if index % columns:
            panels[-1].tick_params(labelleft=False)
    return figure, top, panels


def distance_from_model(bands: Bands, left: Residuals) -> np.ndarray:
    """Return how far each reading is from the force model alone [N]."""
    if not np.isfinite(bands.with_gap_median_N).any():
        return left.residual
    # The residuals are what the discrepancy leaves over too; it knows no temperature.
    curves = {bands.direction[rows[0]]: rows for rows in _curves(bands)}
    gap, found = bands.with_gap_median_N - bands.physics_median_N, left.residual.copy()
    for direction, rows in curves.items():
        rising = (left.direction >= 0.0) == (direction == "up")
        here = rising if len(curves) > 1 else slice(None)
        place = left.deformation[here]
        found[here] += np.interp(place, bands.deformation_mm[rows], gap[rows])
    return found


def _curves(bands: Bands) -> Iterator[np.ndarray]:
    """Yield the rows of each temperature and direction."""
    for temperature in np.unique(bands.temperature_C):
        for direction in dict.fromkeys(bands.direction.tolist()):
            found = (bands.temperature_C == temperature) & (
                bands.direction == direction
            )
            if found.any():
                yield np.flatnonzero(found)


def _draw_curve(
    axes: Axes,
    bands: Bands,
    rows,
    colour: str,
    line,
    weight=1.0,
    *,
    baseline: bool = False,
) -> None:
    x = bands.deformation_mm[rows]
    zero = bands.physics_median_N[rows] if baseline else np.zeros(len(rows))
    tested = np.asarray(bands.tested[rows], dtype=bool)
    untested = beyond(tested)
    bands_here = [("new_measurement", 0.16), ("physics", 0.38)]
    if np.isfinite(bands.with_gap_median_N).any():
        bands_here.insert(1, ("with_gap", 0.22))
    for name, full in bands_here:
        strength = full * weight
        low = getattr(bands, f"{name}_lo_N")[rows] - zero
        high = getattr(bands, f"{name}_hi_N")[rows] - zero
        shade = {"color": colour, "linewidth": 0.0}
        axes.fill_between(x, low, high, where=tested, alpha=strength, **shade)
        axes.fill_between(x, low, high, where=untested, alpha=strength / 3, **shade)
        if name == "new_measurement":
            edge = {"facecolor": "none", "edgecolor": colour, "linewidth": 0.0}
            axes.fill_between(
                x, low, high, where=untested, hatch="////", alpha=0.45, **edge
            )
    middle = bands.physics_median_N[rows] - zero
    axes.plot(x, np.where(tested, middle, np.nan), color=colour, linestyle=line)
    axes.plot(x, np.where(untested, middle, np.nan), color=colour, linestyle=":")
    if len(bands_here) == 3:
        gap = bands.with_gap_median_N[rows] - zero
        axes.plot(x, gap, color=colour, linewidth=1.0, linestyle="-.")


def _draw_points(axes: Axes, left: Residuals, values, here, colour: str) -> None:
    shown = np.zeros(len(values), dtype=bool)
    shown[thinned(len(values))] = True
    small = np.count_nonzero(shown) > 300
    for sense, mark in _MARKS.items():
        rows = shown & here & (left.direction == sense)
        axes.plot(
            left.deformation[rows],
            values[rows],
            mark,
            markersize=2.5 if small else 5.0,
            markerfacecolor=colour,
            markeredgecolor="none" if small else "white",
            markeredgewidth=0.5,
            alpha=0.5 if small else 1.0,
            zorder=4,
            rasterized=small,
        )


def _limit(axes: Axes, bands: Bands, distance: np.ndarray) -> None:
    """Let the bands inside the tested range and the data fill the lower panels."""
    inside = np.asarray(bands.tested, dtype=bool)
    middle = bands.physics_median_N
    edges = [distance]
    for name in ("new_measurement_lo_N", "new_measurement_hi_N"):
        edges.append((getattr(bands, name) - middle)[inside])
    reach = 1.12 * np.max(np.abs(np.concatenate(edges)))
    if np.isfinite(reach) and reach > 0.0:
        axes.set_ylim(-reach, reach)


def _legend(
    axes: Axes, bands: Bands, left: Residuals, levels, colours, solid: str
) -> None:
    main = colours[0] if len(colours) == 1 else GREY
    handles: list = []
    texts: list[str] = []

    def add(handle, text: str) -> None:
        handles.append(handle)
        texts.append(text)

    size = len(left.measured)
    both = len(np.unique(left.direction)) > 1
    ways = movement_words(left.deformation)
    for sense, mark in _MARKS.items():
        if np.any(left.direction == sense):
            style_ = {"marker": mark, "linestyle": "", "color": main, "markersize": 5}
            add(Line2D([], [], **style_), f"measured, {ways[sense]}")
    if size > MOST_DRAWN:
        add(Patch(alpha=0.0), f"({MOST_DRAWN} of {size} readings drawn)")
    line = Line2D([], [], color=main)
    add(
        (Patch(color=main, alpha=0.55, linewidth=0), line), "force model, 95 % credible"
    )
    if both:
        dashed = Line2D([], [], color=main, linestyle=_DASHES)
        add(dashed, f"force model, {ways[-1 if solid == 'up' else 1]}")
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
