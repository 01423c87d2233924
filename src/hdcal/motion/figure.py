"""Figures of a gear that moves: force and deformation over time, with bands."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.inference.posterior import Posterior
from hdcal.motion.bands import MotionBands
from hdcal.motion.respond.respond import Response
from hdcal.report.canvas import (
    BLUE,
    DARK,
    GREY,
    ORANGE,
    heading,
    plain,
    style,
    thinned,
    watermark,
)
from hdcal.report.chart_spec import beyond


def response_figure(response: Response) -> Figure:
    """Draw the force, and below it the band of the deformation."""
    time, unit = _clock(response.time_s)
    with style():
        figure, above, below = _panels(unit)
        _draw_force(above, time, response.force_N)
        lo, hi = response.deformation_lo_mm, response.deformation_hi_mm
        tested = np.asarray(response.tested)
        untested = beyond(tested)
        shade = {"color": BLUE, "linewidth": 0.0}
        below.fill_between(
            time, lo, hi, where=tested, alpha=0.4, label="95 % credible band", **shade
        )
        if untested.any():
            below.fill_between(
                time,
                lo,
                hi,
                where=untested,
                facecolor=BLUE,
                edgecolor=BLUE,
                alpha=0.18,
                hatch="////",
                linewidth=0.0,
                label="95 % credible band, extrapolated",
            )
        middle = response.deformation_median_mm
        below.plot(time, middle, color=BLUE, linewidth=1.0, label="median, row by row")
        name = plain(response.posterior.case.gear.name)
        heading(above, f"{name}: {plain(response.request.words)}")
        heading(below, "Deformation from the unloaded gear")
        _finish(below, lo, hi)
    return figure


def motion_figure(posterior: Posterior, bands: MotionBands) -> Figure:
    """Draw a calibrated record: force, deformation with bands, and what is left."""
    time, unit = _clock(bands.time_s)
    shown = thinned(len(time))
    with style():
        figure, above, below, rest = _panels(unit, left_over=True)
        _draw_force(above, time, bands.force_N)
        below.plot(
            time[shown],
            bands.deformation_mm[shown],
            ".",
            color=DARK,
            markersize=3.0,
            label="measured",
        )
        _draw_bands(below, time, bands, 0.0)
        _draw_bands(rest, time, bands, bands.mean_median_mm)
        below.plot(time, bands.mean_median_mm, color=BLUE, linewidth=0.9)
        left = bands.deformation_mm - bands.mean_median_mm
        rest.plot(time[shown], left[shown], ".", color=DARK, markersize=3.0)
        rest.axhline(0.0, color=DARK, linewidth=0.8, zorder=1)
        heading(above, f"{plain(posterior.case.gear.name)}: force as read, the input")
        heading(below, "Deformation as read")
        heading(rest, "Distance from the model")
        rest.set_ylabel("left over [mm]")
        _finish(below, bands.new_measurement_lo_mm, bands.new_measurement_hi_mm)
        if not posterior.usable:
            watermark(figure)
    return figure


def _draw_bands(axes: Axes, time: np.ndarray, bands: MotionBands, zero) -> None:
    for words, low, high, strength in (
        (
            "one new reading, 95 %",
            bands.new_measurement_lo_mm,
            bands.new_measurement_hi_mm,
            0.16,
        ),
        ("model, 95 % credible", bands.mean_lo_mm, bands.mean_hi_mm, 0.45),
    ):
        shade = {"color": BLUE, "alpha": strength, "linewidth": 0.0}
        axes.fill_between(time, low - zero, high - zero, label=words, **shade)


def _clock(time_s: np.ndarray) -> tuple[np.ndarray, str]:
    """Return the times in a unit that suits their span."""
    if np.ptp(time_s) < 0.5:
        return 1e3 * time_s, "ms"
    return time_s, "s"


def _panels(unit: str, *, left_over: bool = False):
    heights = [1.0, 2.2] + [1.0] * left_over
    figure = Figure(figsize=(7.6, 5.4 + 1.6 * left_over), layout="constrained")
    panels = figure.subplots(
        len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights}
    )
    panels[0].set_ylabel("force [N]")
    panels[1].set_ylabel("deformation [mm]")
    panels[-1].set_xlabel(f"time [{unit}]")
    return figure, *panels


def _draw_force(axes: Axes, time: np.ndarray, force: np.ndarray) -> None:
    axes.plot(time, force, color=ORANGE, linewidth=1.2)
    axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    axes.margins(x=0.0, y=0.15)


def _finish(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    span = max(float(np.max(high) - np.min(low)), 1e-9)
    # Room above for the legend.
    axes.set_ylim(np.min(low) - 0.05 * span, np.max(high) + 0.3 * span)
    axes.legend(loc="upper right", ncols=3)
