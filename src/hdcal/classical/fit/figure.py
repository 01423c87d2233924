"""The figure of classical fits: readings with the curves, and what they leave over."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from hdcal.classical.fit.fit import PolynomialFit
from hdcal.classical.fit.notation import model_name
from hdcal.data.case import Case
from hdcal.report.canvas import CYCLE, DARK, heading, style, thinned


def fit_figure(case: Case, fits: Sequence[PolynomialFit]) -> Figure:
    """Draw readings, curves with their confidence bands, and residuals."""
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    rows = thinned(len(x))
    grid = np.linspace(min(0.0, x.min()), max(0.0, x.max()), 200)
    small = len(rows) > 300
    size = {"markersize": 2.0 if small else 5.0, "markeredgecolor": "none"}
    with style():
        figure = Figure(figsize=(7.6, 5.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.5, 1.0])
        above.plot(x[rows], y[rows], "o", color=DARK, label="readings", **size)
        for place, one in enumerate(fits):
            colour, name = CYCLE[place % len(CYCLE)], model_name(one.powers)
            line = "-" if one.powers[0] == 0 else "--"
            ends = [one.at(value) for value in grid]
            middle = [end["force"] for end in ends]
            above.plot(grid, middle, line, color=colour, label=name, linewidth=1.4)
            bounds = [[end[side] for end in ends] for side in ("lo", "hi")]
            above.fill_between(grid, *bounds, color=colour, alpha=0.15, linewidth=0.0)
            left = y - x[:, None] ** np.array(one.powers) @ one.coefficients
            order = rows[np.argsort(x[rows], kind="stable")]
            mark = "o" if small else f"o{line}"
            below.plot(x[order], left[order], mark, color=colour, linewidth=0.9, **size)
        below.axhline(0.0, color=DARK, linewidth=0.8)
        heading(above, "Readings and fitted curves")
        heading(below, "What each curve leaves over")
        above.set_ylabel("force as read [N]")
        below.set_ylabel("reading − curve [N]")
        below.set_xlabel("deformation as read [mm]")
        above.legend(loc="upper left")
    return figure
