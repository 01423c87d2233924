"""The figure of a check: the readings, and nothing computed from them."""

import numpy as np
from matplotlib.figure import Figure

from hdcal.data.case import Case
from hdcal.report.canvas import CYCLE, heading, plain, style, thinned

_MOST_NAMED = 8


def readings_figure(case: Case) -> Figure:
    """Draw force over deformation, each gear or mounting in its colour."""
    records = case.records
    gears = len(case.specimen_labels) > 1
    names, index = (
        (case.specimen_labels, records.specimen)
        if gears
        else (case.run_labels, records.run)
    )
    shown = np.zeros(len(records.force), dtype=bool)
    shown[thinned(len(shown))] = True
    with style():
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        axes = figure.add_subplot()
        for one, name in enumerate(names):
            rows = shown & (np.asarray(index) == one)
            axes.plot(
                np.asarray(records.deformation)[rows],
                np.asarray(records.force)[rows],
                ".-",
                color=CYCLE[one % len(CYCLE)],
                linewidth=0.6,
                markersize=4.0,
                label=plain(name, 30),
            )
        heading(axes, f"{plain(case.name)}: the readings, in the order they were taken")
        axes.set_xlabel(f"deformation as read ({case.gear.reading}) [mm]")
        axes.set_ylabel("force as read [N]")
        if 1 < len(names) <= _MOST_NAMED:
            axes.legend(title="specimen" if gears else "run")
    return figure
