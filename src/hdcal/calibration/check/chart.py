"""A case as a chart: the readings, and nothing computed from them."""

import numpy as np

from hdcal.data.case import Case
from hdcal.report.canvas import thinned
from hdcal.report.chart import COLOURS, Chart, Series


def case_chart(case: Case) -> Chart:
    """Return force over deformation, each gear in its colour, or each mounting."""
    records = case.records
    several = len(case.specimen_labels) > 1
    names = case.specimen_labels if several else case.run_labels
    index = np.asarray(records.specimen if several else records.run)
    shown = np.zeros(len(index), dtype=bool)
    shown[thinned(len(index))] = True
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    what = "specimen" if several else "run" if len(names) > 1 else ""
    series = []
    for one, name in enumerate(names):
        rows = shown & (index == one)
        label = f"{what} {name}" if what else "readings"
        colour = COLOURS[one % len(COLOURS)]
        series.append(Series(label, x[rows], y[rows], colour, points=True))
    along = f"deformation as read ({case.gear.reading}) [mm]"
    return Chart(along, "force as read [N]", series)
