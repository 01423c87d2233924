"""A study as a chart: the force over the size that was varied first."""

import numpy as np

from hdcal.design.study.study import Study
from hdcal.report.chart import COLOURS, Chart, Series


def study_chart(found: Study) -> Chart:
    """Return the median force of every design, and its interval, as points."""
    name = found.varied[0]
    x = np.asarray(found.columns[name], dtype=float)
    label = name.replace("_", " ")
    ends = {"median": COLOURS[0], "hi": "#8a949c", "lo": "#8a949c"}
    series = [
        Series(
            f"force, {end} [N]", x, found.columns[f"force_{end}_N"], hue, points=True
        )
        for end, hue in ends.items()
    ]
    return Chart(label, "force [N]", series)
