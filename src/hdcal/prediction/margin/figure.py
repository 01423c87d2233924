"""The figures of a margin: bounds beside the capacity, and what they hang on."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hdcal.prediction.margin.result import Margin
from hdcal.prediction.margin.sentences import (
    bound_name,
    input_label,
    larger_bound,
    member_word,
)
from hdcal.prediction.margin.stated import BudgetLine
from hdcal.prediction.margin.temperatures import shown_levels
from hdcal.report.axes import load_axis
from hdcal.report.canvas import (
    BLUE,
    DARK,
    ORANGE,
    RED,
    heading,
    name_rows,
    note,
    plain,
    style,
)

_TYPES = {"A": BLUE, "B": ORANGE}
_TYPE_WORDS = {"A": "A: from the readings", "B": "B: from elsewhere"}
# Rows of the budget below this share say nothing, nor do more than so many.
_SMALL, _MOST_ROWS = 1e-3, 8


def margin_figures(found: Margin, name: str) -> dict[str, Figure]:
    """Return the figures of a margin by name; without a budget there is no tornado."""
    drawn = {"margin": margin_figure(found, name)}
    return drawn | ({"tornado": tornado_figure(found)} if found.budget else {})


def margin_figure(found: Margin, name: str) -> Figure:
    """Draw the force needed with its bounds, over temperature if there are several."""
    several = len(found.levels) > 1
    with style():
        height = 6.0 if several else 2.9
        figure = Figure(figsize=(7.6, height), layout="constrained")
        ratios = [1.0, 1.5] if several else [1.0]
        panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)
        _draw_spans(panels[0, 0], found)
        at = f"{found.deformation_mm:g} {found.units.displacement_unit}"
        warm = f"{found.worst.temperature_C:g} °C"
        worst = f", worst temperature {warm}" if several else f", {warm}"
        heading(
            panels[0, 0], f"{plain(name)}: {found.units.load} needed at {at}{worst}"
        )
        if several:
            _draw_window(panels[1, 0], found)
    return figure


def draw_margin(found: Margin, axes: Axes) -> Axes:
    """Draw bounds and capacity: at one temperature, or over several."""
    several = len(found.levels) > 1
    (_draw_window if several else _draw_spans)(axes, found)
    return axes


def _draw_spans(axes: Axes, found: Margin) -> None:
    level, unit = found.worst, found.units.load_unit
    rows = [
        ("mean, 95 % credible", level.force_N, 0.75),
        (f"one {member_word(found)},\n95 % predictive", level.member_N, 0.35),
    ]
    for place, (_, span, strength) in enumerate(rows):
        axes.plot(
            [span.lo, span.hi],
            [place, place],
            color=BLUE,
            alpha=strength,
            linewidth=11.0,
            solid_capstyle="butt",
        )
        axes.plot(span.median, place, "o", color="white", markersize=4.5)
    ends = [level.lower_bound_N, level.upper_bound_N]
    axes.plot(ends, [2, 2], color=DARK, linewidth=1.2)
    # Away from each other: bounds may be near.
    for end, mark, side in zip(ends, "<>", ("right", "left"), strict=True):
        axes.plot(end, 2, mark, color=DARK, markersize=7)
        shift = -3 if side == "right" else 3
        note(axes, f"{end:.1f} {unit}", (end, 2), (shift, -15), ha=side)
    words = [row[0] for row in rows] + [f"{bound_name(found)} bounds,\none-sided each"]
    name_rows(axes, words)
    axes.set_ylim(2.75, -0.6)
    axes.set_xlabel(load_axis(found.units))
    axes.margins(x=0.15)
    if found.limit_force_N is not None:
        sense, words = found.loading_sense, f"capacity {found.limit_force_N:g} {unit}"
        limit = sense * found.limit_force_N
        axes.axvline(limit, color=RED, linewidth=1.4)
        behind = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        side = "right" if sense > 0 else "left"
        place = {"ha": side, "va": "center", "bbox": behind}
        note(axes, words, (limit, 0.5), (-4 * sense, 0), color=RED, **place)


def _draw_window(axes: Axes, found: Margin) -> None:
    heading(axes, "Over temperature")
    levels = shown_levels(found.levels)
    warm = np.array([level.temperature_C for level in levels])

    def ends(name: str) -> tuple[np.ndarray, np.ndarray]:
        spans = [getattr(level, name) for level in levels]
        return np.array([s.lo for s in spans]), np.array([s.hi for s in spans])

    axes.fill_between(warm, *ends("member_N"), color=BLUE, alpha=0.18, linewidth=0)
    axes.fill_between(warm, *ends("force_N"), color=BLUE, alpha=0.45, linewidth=0)
    for name in ("lower_bound_N", "upper_bound_N"):
        line = [getattr(level, name) for level in levels]
        axes.plot(warm, line, color=DARK, linewidth=1.2)
    untested = np.array([not level.tested for level in levels])
    axes.plot(
        warm[untested],
        np.array([level.force_N.median for level in levels])[untested],
        "o",
        markerfacecolor="white",
        markeredgecolor=BLUE,
        markersize=5,
    )
    handles = [
        Line2D([], [], color=DARK, linewidth=1.2),
        Patch(color=BLUE, alpha=0.5, linewidth=0),
        Patch(color=BLUE, alpha=0.2, linewidth=0),
    ]
    texts = [f"{bound_name(found)} bounds", "mean, 95 %", f"one {member_word(found)}"]
    if untested.any():
        handles.append(
            Line2D(
                [], [], marker="o", color=BLUE, linestyle="", markerfacecolor="white"
            )
        )
        texts.append("not tested: extrapolated")
    if found.limit_force_N is not None:
        limit = found.loading_sense * found.limit_force_N
        axes.axhline(limit, color=RED, linewidth=1.4)
        handles.append(Line2D([], [], color=RED))
        texts.append("capacity")
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel(load_axis(found.units))
    axes.margins(y=0.12)
    under = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2)}
    axes.legend(handles, texts, ncols=3, **under)


def tornado_figure(found: Margin) -> Figure:
    """Draw the shares of the budget, and how far one per cent moves the bound."""
    rows = max(len(_large(found)), len(found.gradients))
    with style():
        figure = Figure(figsize=(8.8, 1.5 + 0.34 * rows), layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw_shares(left, found)
        _draw_gradients(right, found)
    return figure


def _large(found: Margin) -> list[BudgetLine]:
    """Return the rows of the budget that can be seen."""
    return [line for line in found.budget if line.share >= _SMALL][:_MOST_ROWS]


def _draw_shares(axes: Axes, found: Margin) -> None:
    heading(axes, f"What makes one {member_word(found)} uncertain")
    ranked = _large(found)
    for place, line in enumerate(ranked):
        axes.barh(place, line.share, 0.66, color=_TYPES[line.type])
        words = f"{100.0 * line.share:.0f} %"
        note(axes, words, (line.share, place), (3, 0), va="center")
    name_rows(axes, [line.component for line in ranked])
    axes.set_ylim(len(ranked) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.18)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    axes.set_xlabel("share of the variance (budget)")
    seen = dict.fromkeys(line.type for line in ranked)
    handles = [Patch(color=_TYPES[type_], linewidth=0) for type_ in seen]
    words = [_TYPE_WORDS[type_] for type_ in seen]
    axes.legend(handles, words, loc="lower right", fontsize=7.5)


def _draw_gradients(axes: Axes, found: Margin) -> None:
    heading(axes, f"{larger_bound(found).capitalize()} bound, for + 1 % of")
    ranked = sorted(found.gradients, key=lambda slope: -abs(slope.bound_N_per_percent))
    values = [slope.bound_N_per_percent for slope in ranked]
    sense = found.loading_sense
    colours = [RED if sense * value > 0.0 else BLUE for value in values]
    axes.barh(range(len(ranked)), values, 0.66, color=colours, alpha=0.75)
    for place, value in enumerate(values):
        shift, side = ((3, 0), "left") if value > 0.0 else ((-3, 0), "right")
        note(
            axes,
            f"{value:+.2f} {found.units.load_unit}",
            (value, place),
            shift,
            va="center",
            ha=side,
        )
    axes.axvline(0.0, color=DARK, linewidth=0.8)
    name_rows(axes, [input_label(slope.name) for slope in ranked])
    axes.set_ylim(len(ranked) - 0.4, -0.6)
    axes.margins(x=0.4)
    axes.set_xlabel(load_axis(found.units, "change"))
