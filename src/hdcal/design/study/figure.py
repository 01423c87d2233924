"""The figure of a study: lines with bands, or a map of two sizes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.design.document import HEADINGS
from hdcal.design.study.study import Study
from hdcal.report.canvas import BLUE, CYCLE, DARK, heading, plain, style

# Cells of a map up to which their numbers are written in them.
_MOST_NUMBERS = 80
_MOST_LINES = 6


def study_figure(found: Study) -> Figure:
    """Draw the force over what was varied.

    One size gives a line with its band, two give a map; of more, the first two at the
    middle of the others. Materials give a line, or a map, each.
    """
    sizes = [name for name in found.varied if name != "material"]
    rows = _middle_rows(found, sizes[2:])
    materials = list(dict.fromkeys(found.columns["material"].tolist()))
    with style():
        if len(sizes) >= 2:
            return _maps(found, sizes, rows, materials[:_MOST_LINES])
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = figure.subplots()
        _lines(axes, found, sizes, rows, materials[:_MOST_LINES])
    return figure


def _middle_rows(found: Study, rest: list[str]) -> np.ndarray:
    """Return the rows at the middle value of the columns that are not drawn."""
    rows = np.ones(len(found.columns["material"]), dtype=bool)
    for name in rest:
        values = np.unique(found.columns[name])
        rows &= found.columns[name] == values[len(values) // 2]
    return rows


def _lines(axes: Axes, found: Study, sizes, rows, materials) -> None:
    columns, band = found.columns, found.interval_kind.replace("equal-tailed ", "")
    for material, colour in zip(materials, CYCLE, strict=False):
        here = rows & (columns["material"] == material)
        middle = columns["force_median_N"][here]
        low, high = columns["force_lo_N"][here], columns["force_hi_N"][here]
        words = f"{plain(material)}: median, {100 * found.interval:g} % {band}"
        if sizes and len(middle) > 1:
            along = columns[sizes[0]][here]
            order = np.argsort(along)
            span = along[order], low[order], high[order]
            axes.fill_between(*span, color=colour, alpha=0.25, linewidth=0)
            axes.plot(along[order], middle[order], ".-", color=colour, label=words)
        else:
            reach = [middle - low, high - middle]
            axes.errorbar(
                [plain(material)], middle, reach, fmt="o", color=BLUE, capsize=4
            )
    axes.set_xlabel(HEADINGS[sizes[0]] if sizes else "material")
    axes.set_ylabel("force [N]")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")
    heading(axes, _title(found))


def _maps(found: Study, sizes, rows, materials) -> Figure:
    wide = len(materials)
    figure = Figure(figsize=(2.2 + 5.0 * wide, 4.4), layout="constrained")
    panels = figure.subplots(1, wide, squeeze=False)[0]
    force = found.columns["force_median_N"]
    for axes, material in zip(panels, materials, strict=True):
        here = rows & (found.columns["material"] == material)
        x, y = (np.unique(found.columns[name][here]) for name in sizes[:2])
        table = np.full((len(y), len(x)), np.nan)
        column = np.searchsorted(x, found.columns[sizes[0]][here])
        line = np.searchsorted(y, found.columns[sizes[1]][here])
        table[line, column] = force[here]
        drawn = axes.pcolormesh(
            range(len(x)), range(len(y)), table, cmap="cividis", shading="nearest"
        )
        drawn.set_clim(float(force[rows].min()), float(force[rows].max()))
        axes.grid(visible=False)
        _ticks(axes, x, y)
        if table.size <= _MOST_NUMBERS:
            _numbers(axes, table, drawn)
        axes.set_xlabel(HEADINGS[sizes[0]])
        axes.set_ylabel(HEADINGS[sizes[1]])
        heading(axes, _title(found) if wide == 1 else plain(material))
        figure.colorbar(drawn, ax=axes, label="median force [N]")
    return figure


def _ticks(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    for values, put in ((x, axes.set_xticks), (y, axes.set_yticks)):
        shown = np.unique(
            np.linspace(0, len(values) - 1, min(len(values), 9), dtype=int)
        )
        put(shown, [f"{values[i]:.4g}" for i in shown])


def _numbers(axes: Axes, table: np.ndarray, drawn) -> None:
    for (line, column), value in np.ndenumerate(table):
        dark = drawn.norm(value) > 0.55
        colour = DARK if dark else "white"
        axes.text(column, line, f"{value:.4g}", ha="center", va="center", color=colour)


def _title(found: Study) -> str:
    fixed = []
    for name, unit in (("deformation_mm", "mm"), ("temperature_C", "°C")):
        if name not in found.varied:
            fixed.append(f"{found.columns[name][0]:g} {unit}")
    where = f" at {', '.join(fixed)}" if fixed else ""
    known = " (prior only)" if found.basis.kind == "prior" else ""
    return f"{plain(found.basis.gear.name, 40)}: force{where}{known}"
