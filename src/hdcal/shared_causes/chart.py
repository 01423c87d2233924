"""How often each cause is, as a chart."""

import numpy as np

from hdcal.report.chart import COLOURS, Chart, Series, interval_boxes
from hdcal.report.words import label
from hdcal.shared_causes.causes import FleetCauses
from hdcal.shared_causes.document import RARE


def causes_chart(found: FleetCauses) -> Chart:
    """Return the share of each cause among gears to come, the most frequent first."""
    low, middle, high = 100.0 * np.quantile(found.share, [0.025, 0.5, 0.975], axis=0)
    order = np.argsort(-found.share.mean(axis=0), kind="stable")
    order = order[found.share.mean(axis=0)[order] >= RARE]
    place = np.arange(1.0, len(order) + 1.0)
    curves = interval_boxes(place, low[order], high[order], unit="%")
    points = Series("median [%]", place, middle[order], COLOURS[1], points=True)
    names = [label(found.causes[k]) for k in order]
    axis = "causes", "share of gears to come [%]"
    bands, limits = [(0, 1, 0.25)], (0.0, 100.0)
    return Chart(*axis, [*curves, points], bands, names=names, limits=limits)
