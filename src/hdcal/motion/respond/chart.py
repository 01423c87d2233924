"""A response as a chart: the deformation over time."""

import numpy as np

from hdcal.motion.respond.respond import Response
from hdcal.report.chart import COLOURS, Chart, Series
from hdcal.report.chart_spec import beyond


def response_charts(response: Response) -> tuple[Chart, Chart]:
    """Return the force over time, and what it does to the deformation."""
    force = Series("force [N]", response.time_s, response.force_N, "")
    return Chart("time [s]", "force [N]", [force], height=240), response_chart(response)


def response_chart(response: Response) -> Chart:
    """Return the pointwise band of the deformation over time."""
    time, colour = response.time_s, COLOURS[0]
    ends = {"97.5 %": response.deformation_hi_mm, "2.5 %": response.deformation_lo_mm}
    series = [
        Series(f"deformation, {name} [mm]", time, y, colour, width=0.0)
        for name, y in ends.items()
    ]
    tested = np.asarray(response.tested)
    for words, rows, dashed in (
        ("median [mm]", tested, False),
        ("median, not tested [mm]", beyond(tested), True),
    ):
        if rows.any():
            y = np.where(rows, response.deformation_median_mm, np.nan)
            series.append(Series(words, time, y, colour, dashed=dashed))
    return Chart("time [s]", "deformation [mm]", series, [(0, 1, 0.3)])
