"""A margin as a chart: the force needed over temperature."""

from collections.abc import Sequence

import numpy as np

from hdcal.prediction.margin.result import Level, Margin
from hdcal.report.chart import COLOURS, Chart, Series


def level_rows(found: Margin) -> Sequence[Level]:
    """Return what is known at each temperature."""
    return found.levels


def margin_chart(found: Margin) -> Chart:
    """Return mean and bounds at each temperature, and the capacity."""
    levels = sorted(found.levels, key=lambda level: level.temperature_C)
    x = np.array([level.temperature_C for level in levels])
    rows = {
        "upper bound [N]": [level.upper_bound_N for level in levels],
        "lower bound [N]": [level.lower_bound_N for level in levels],
        "mean [N]": [level.force_N.median for level in levels],
    }
    alone = len(x) == 1
    series = [
        Series(name, x, np.array(y), COLOURS[0], points=alone or name[0] == "m")
        for name, y in rows.items()
    ]
    if found.limit_force_N is not None:
        limit = np.full(len(x), found.limit_force_N * found.loading_sense)
        series.append(Series("capacity [N]", x, limit, COLOURS[1], points=alone))
    return Chart(
        "temperature [°C]", "force [N]", series, [] if alone else [(0, 1, 0.2)]
    )
