"""A response as a chart: the deformation over time."""

from hdcal.motion.respond.respond import Response
from hdcal.report.chart import COLOURS, Chart, Series


def response_charts(response: Response) -> tuple[Chart, Chart]:
    """Return the force over time, and what it does to the deformation."""
    force = Series("force [N]", response.time_s, response.force_N, "")
    return Chart("time [s]", "force [N]", [force], height=240), response_chart(response)


def response_chart(response: Response) -> Chart:
    """Return the pointwise band of the deformation over time."""
    ends = {
        "97.5 %": response.deformation_hi_mm,
        "2.5 %": response.deformation_lo_mm,
        "median": response.deformation_median_mm,
    }
    series = [
        Series(
            f"deformation, {name} [mm]",
            response.time_s,
            y,
            COLOURS[0],
            width=2.0 * (name == "median"),
        )
        for name, y in ends.items()
    ]
    return Chart("time [s]", "deformation [mm]", series, [(0, 1, 0.3)])
