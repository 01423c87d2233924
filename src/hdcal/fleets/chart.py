"""A fleet as a chart: every gear with its interval, by stiffness."""

import numpy as np

from hdcal.fleets.fleet import Fleet
from hdcal.report.chart import COLOURS, Chart, Series, interval_boxes

_MOST_NAMED = 3
# More than these a screen does not tell apart.
MOST_SHOWN = 10_000


def fleet_chart(found: Fleet) -> Chart:
    """Return the stiffness of each gear, those called off in a colour of their own."""
    low, middle, high = np.quantile(found.stiffness, [0.025, 0.5, 0.975], axis=0)
    order = np.argsort(middle, kind="stable")
    if len(order) > MOST_SHOWN:
        # Those called off, and others from the softest to the stiffest.
        shown = found.off_in["stiffness"][order]
        shown[np.linspace(0, len(order) - 1, MOST_SHOWN).astype(int)] = True
        order = order[shown]
    place, off = np.arange(1.0, len(order) + 1.0), found.off_in["stiffness"][order]
    units = found.case.units
    unit = units.stiffness_unit
    curves = interval_boxes(place, low[order], high[order], unit=unit)
    odd = [found.case.specimen_labels[gear] for gear in order[off]]
    called = "off in stiffness" + f": {', '.join(odd)}" * (len(odd) <= _MOST_NAMED)
    kinds = (("gears", ~off, COLOURS[0]), (called, off, COLOURS[1]))
    points = [
        Series(
            f"{words} [{units.stiffness_unit}]",
            place[rows],
            middle[order][rows],
            hue,
            points=True,
        )
        for words, rows, hue in kinds
        if rows.any()
    ]
    whose = "at one size" if found.at_one_size else "as read"
    axis = (
        "gears by their stiffness",
        f"{units.stiffness} {whose} [{units.stiffness_unit}]",
    )
    names = [found.case.specimen_labels[gear] for gear in order]
    bands, marked = [(0, 1, 0.25)], (np.flatnonzero(off) + 1).tolist()
    return Chart(*axis, [*curves, *points], bands, names=names, marked=marked)
