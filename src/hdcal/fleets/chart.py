"""A fleet as a chart: every gear with its interval, by stiffness."""

import numpy as np

from hdcal.fleets.fleet import Fleet
from hdcal.report.chart import COLOURS, Chart, Series


def fleet_chart(found: Fleet) -> Chart:
    """Return the stiffness of each gear, those called off in a colour of their own."""
    low, middle, high = np.quantile(found.stiffness, [0.025, 0.5, 0.975], axis=0)
    order = np.argsort(middle, kind="stable")
    place, off = np.arange(1.0, len(order) + 1.0), found.called[order]
    curves = [
        Series(f"95 % interval, {side} [N/mm]", place, end[order], COLOURS[0], width=0)
        for side, end in (("97.5 %", high), ("2.5 %", low))
    ]
    kinds = (("gears", ~off, COLOURS[0]), ("called off", off, COLOURS[1]))
    points = [
        Series(f"{words} [N/mm]", place[rows], middle[order][rows], hue, points=True)
        for words, rows, hue in kinds
        if rows.any()
    ]
    axis = "gears by their stiffness", "stiffness as read [N/mm]"
    return Chart(*axis, [*curves, *points], [(0, 1, 0.25)])
