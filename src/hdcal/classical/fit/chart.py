"""Classical fits as charts: readings with the curves, and what these leave over."""

from collections.abc import Sequence

import numpy as np

from hdcal.classical.fit.fit import PolynomialFit
from hdcal.classical.fit.notation import model_name
from hdcal.data.case import Case
from hdcal.report.canvas import thinned
from hdcal.report.chart import COLOURS, Chart, Series

_AXIS = "deformation as read [mm]"


def fit_charts(case: Case, fits: Sequence[PolynomialFit]) -> tuple[Chart, Chart]:
    """Return force over deformation, and readings less each curve."""
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    rows = thinned(len(x))
    grid = np.linspace(min(0.0, x.min()), max(0.0, x.max()), 200)
    curves, between, left = [], [], []
    for place, one in enumerate(fits):
        colour, name = COLOURS[place % len(COLOURS)], model_name(one.powers)
        ends = [one.at(value) for value in grid]
        between.append((len(curves) + 1, len(curves), 0.15))
        for key, label, width in (
            ("lo", f"band of {name}, lower end [N]", 0.0),
            ("hi", f"band of {name}, upper end [N]", 0.0),
            ("force", f"{name} [N]", 2.0),
        ):
            line = np.array([end[key] for end in ends])
            curves.append(Series(label, grid, line, colour, width=width))
        rest = y - x[:, None] ** np.array(one.powers) @ one.coefficients
        label = f"reading − {name} [N]"
        left.append(Series(label, x[rows], rest[rows], colour, points=True))
    readings = Series("reading [N]", x[rows], y[rows], "", points=True)
    return (
        Chart(_AXIS, "force as read [N]", [*curves, readings], between),
        Chart(_AXIS, "reading − curve [N]", left, height=240),
    )
