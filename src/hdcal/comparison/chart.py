"""A comparison as a chart: every result with its interval."""

import numpy as np

from hdcal.comparison.compare import Comparison
from hdcal.report.chart import COLOURS, Chart, Series, interval_boxes
from hdcal.report.parameters import credible_interval


def comparison_chart(found: Comparison) -> Chart:
    """Return the stiffness of each result, in the order in which they were given."""
    spans = [credible_interval(draws) for draws in found.stiffness]
    place = np.arange(1.0, len(spans) + 1.0)
    low, middle, high = (
        np.array([getattr(span, end) for span in spans])
        for end in ("lo", "median", "hi")
    )
    curves = interval_boxes(place, low, high)
    points = Series("median [N/mm]", place, middle, COLOURS[1], points=True)
    axis = "results as they were given", "stiffness as read [N/mm]"
    return Chart(*axis, [*curves, points], [(0, 1, 0.25)], names=found.names)
