"""Effects and shares of the gap in sentences, and their places in the pictures."""

import numpy as np
from diagnosis_cases import rich, simulated

from hdcal.diagnosis.charts import gap_chart
from hdcal.diagnosis.gap import GapByRow
from hdcal.diagnosis.wording import either, share_words, together
from hdcal.report.chart_spec import Band, Line
from hdcal.report.item import Interval


def test_a_share_has_whole_percents_and_never_exceeds_all():
    assert "55 % (45 … 63 %)" in share_words(Interval(median=0.553, lo=0.448, hi=0.63))
    assert "at least 52 %" in share_words(Interval(median=0.998, lo=0.52, hi=1.0))
    assert "%" not in share_words(Interval(median=1.0, lo=0.998, hi=1.0))
    assert share_words(Interval(median=0.0, lo=0.0, hi=0.004)).startswith("less than")


def test_classes_name_three_effects_at_most_and_noise_comes_last():
    assert either(["a", "b"]) == "a or b"
    assert either(["a", "b", "c"]).count(",") == 1
    assert "3 others" in either(["a", "b", "c", "d", "e"])
    assert together(["outliers", "hysteresis"]).endswith("wild readings")


def test_the_gap_is_drawn_for_each_half_cycle():
    case = simulated(rich(), seed=1)
    count = len(case.records.force)
    draws = np.tile(np.arange(count, dtype=float), (5, 1))
    chart = gap_chart(case, GapByRow(case.records, np.zeros(count), draws))
    marks = chart.panels[0].marks
    lines = [mark for mark in marks if isinstance(mark, Line)]
    turns = np.count_nonzero(np.diff(np.asarray(case.records.sense))) + 1
    assert len(lines) == len([m for m in marks if isinstance(m, Band)]) == turns
    assert sum(len(line.x) for line in lines) == count
    assert all(np.all(np.diff(line.x) >= 0.0) for line in lines)
    assert sum(bool(line.label) for line in lines) == 2
