"""Where the gap lies, as charts: the same means, readings and sums as the verdict's."""

from dataclasses import replace

import numpy as np
import pytest
from verdicts import named, none

from hdcal.diagnosis.chart import running_sums, verdict_chart, where_charts
from hdcal.diagnosis.where import about


def levels(series) -> np.ndarray:
    """Return the levels of boxes, without what lies between them."""
    return series.y[np.isfinite(series.y)][::3]


def test_every_covariate_has_a_chart_with_its_means_and_what_is_off():
    verdict = named()
    ranges, names = verdict.where.by_covariate()
    charts = where_charts(verdict)
    assert len(charts) == len(ranges) + len(names) + 2
    assert [chart.x.split(" [")[0] for chart in charts[: len(ranges)]] == [*ranges]
    assert {"deformation", "temperature", "time"} <= {*ranges}
    assert {"direction", "direction × deformation"} <= {*names}
    every = [*ranges.values(), *names.values()]
    for chart, cells in zip(charts, every, strict=False):
        by = {series.label: series for series in chart.series}
        calm = [c.bias_N.median for c in cells if not c.hot]
        hot = [c.bias_N.median for c in cells if c.hot]
        for label, expected in (("mean [N]", calm), ("mean, off [N]", hot)):
            assert (label in by) == bool(expected)
            if expected:
                np.testing.assert_array_equal(levels(by[label]), expected)
        upper, lower, _ = chart.bands[0]
        width = levels(chart.series[upper]) - levels(chart.series[lower])
        expected = [cell.bias_N.hi - cell.bias_N.lo for cell in cells]
        np.testing.assert_allclose(width, expected)
        for series in chart.series:
            assert series.points or (np.diff(series.x) > 0.0).all()
    assert charts[len(ranges)].names == [cell.label for cell in names["direction"]]
    # A level of temperature has a width that can be seen.
    (warm,) = (chart for chart in charts if chart.x.startswith("temperature"))
    box = warm.series[0].x[:2]
    assert 1.0 < np.ptp(box) < 5.0


def test_levels_that_are_near_do_not_stand_in_each_others_place():
    verdict = named()
    first = next(c for c in verdict.where.cells if c.covariate == "temperature")
    near = [
        replace(first, from_=level, to=level, bias_N=about(level, 1.0))
        for level in (100.0, 20.0, 21.0)
    ]
    where = replace(verdict.where, cells=tuple(near))
    (chart,) = (
        chart
        for chart in where_charts(replace(verdict, where=where))
        if chart.x.startswith("temperature")
    )
    mean = next(one for one in chart.series if one.label.startswith("mean"))
    for level in (20.0, 21.0, 100.0):
        assert np.interp(level, mean.x, mean.y) == level


def test_readings_and_gap_lie_where_they_were_read():
    verdict = named()
    *_, read, gap = verdict_chart(verdict).series
    np.testing.assert_array_equal(read.x, verdict.where.records.deformation)
    np.testing.assert_array_equal(read.y, verdict.where.residual_N)
    np.testing.assert_array_equal(gap.y, verdict.where.gap_N)


def test_the_running_sum_of_noise_stays_within_its_reach_and_a_gap_does_not():
    verdict = named()
    (_, _, over, reach), (_, row, by_row, _) = running_sums(verdict)
    assert over[-1] == pytest.approx(np.sum(verdict.where.residual_N))
    np.testing.assert_array_equal(row, np.arange(len(over)) + 1.0)
    assert max(np.abs(over).max(), np.abs(by_row).max()) > reach
    for *_, total, reach in running_sums(none()):
        assert np.abs(total).max() < reach
