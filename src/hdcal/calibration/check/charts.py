"""Chart of the readings of a case."""

import numpy as np

from hdcal.data.case import Case
from hdcal.report.chart_spec import CYCLE, Chart, Panel, Points, drawn_rows


def readings_chart(case: Case) -> Chart:
    """Return force over deformation, each specimen in a colour, or else each run."""
    records = case.records
    several = len(case.specimen_labels) > 1
    names = case.specimen_labels if several else case.run_labels
    index = np.asarray(records.specimen if several else records.run)
    kind = "specimen " if several else "run "
    drawn = drawn_rows(np.asarray(records.force))
    x, y, group = (
        np.asarray(values)[drawn]
        for values in (records.deformation, records.force, index)
    )
    marks = [
        Points(
            label=f"{kind}{names[place]}" if len(names) > 1 else "",
            x=x[group == place],
            y=y[group == place],
            colour=CYCLE[place % len(CYCLE)],
        )
        for place in np.unique(group)
    ]
    panel = Panel(
        x=f"deformation as read ({case.gear.reading}) [mm]",
        y="force as read [N]",
        marks=marks,
        title=f"{case.name}: readings",
    )
    return Chart(panels=[panel])
