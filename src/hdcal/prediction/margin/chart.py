"""A margin as a chart: the force needed over temperature."""

from collections.abc import Sequence

import numpy as np

from hdcal.prediction.margin.result import Level, Margin
from hdcal.prediction.margin.sentences import bound_name, member_word
from hdcal.report.axes import load_axis
from hdcal.report.chart import COLOURS, Chart, Series


def level_rows(found: Margin) -> Sequence[Level]:
    """Return what is known at each temperature."""
    return found.levels


def margin_chart(found: Margin) -> Chart:
    """Return mean and member with their bands, the bounds and the capacity."""
    levels = sorted(found.levels, key=lambda level: level.temperature_C)
    x = np.array([level.temperature_C for level in levels])
    series: list[Series] = []
    units = found.units
    for words, name in (
        (f"one {member_word(found)}", "member_N"),
        ("mean", "force_N"),
    ):
        for end, side in (("hi", "97.5 %"), ("lo", "2.5 %")):
            y = np.array([getattr(getattr(level, name), end) for level in levels])
            label = load_axis(units, f"{words}, {side}")
            series.append(Series(label, x, y, COLOURS[0], width=0.0))
    bounds = bound_name(found)
    upper, lower = (load_axis(units, f"{bounds} {side}") for side in ("upper", "lower"))
    lines = {
        load_axis(units, "mean"): (
            [level.force_N.median for level in levels],
            COLOURS[0],
        ),
        upper: (
            [level.upper_bound_N for level in levels],
            "",
        ),
        lower: (
            [level.lower_bound_N for level in levels],
            "",
        ),
    }
    if found.limit_force_N is not None:
        limit = [found.limit_force_N * found.loading_sense] * len(levels)
        lines[load_axis(units, "capacity")] = limit, COLOURS[1]
    series += [Series(n, x, np.array(y), hue) for n, (y, hue) in lines.items()]
    between = [(0, 1, 0.18), (2, 3, 0.4)]
    return Chart("temperature [°C]", load_axis(units), series, between)
