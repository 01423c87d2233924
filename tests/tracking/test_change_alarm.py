"""False alarms of the change alarm are as frequent as stated."""

import numpy as np
import pytest

from hdcal.tracking.change_alarm import (
    run_length,
    step_sums,
    threshold_for,
)


@pytest.mark.parametrize(
    ("h", "shift", "rows"),
    # Published for k = ½, two-sided (Montgomery, Introduction to Statistical Quality
    # Control, after Lucas and Crosier 1982).
    [(4.0, 0.0, 168.0), (5.0, 0.0, 465.0), (4.0, 1.0, 8.38), (5.0, 1.0, 10.4)],
)
def test_run_lengths_are_the_published_ones(h, shift, rows):
    above, below = run_length(h, shift), run_length(h, -shift)
    assert 1.0 / (1.0 / above + 1.0 / below) == pytest.approx(rows, rel=5e-3)


@pytest.mark.parametrize("rows", [10.0, 1e4, 1e9])
def test_a_threshold_gives_back_its_rate(rows):
    assert run_length(threshold_for(rows)) == pytest.approx(2.0 * rows, rel=1e-6)


def test_an_alarm_restarts_the_sums():
    h, sums, lines = threshold_for(200.0), np.zeros(2), []
    for _ in range(8):
        sums, *line = step_sums(sums, 2.0, h)
        lines.append(tuple(map(float, line)))
    assert [score for score, _ in lines[:2]] == pytest.approx([1.5 / h, 3.0 / h])
    first = next(i for i, (_, alarm) in enumerate(lines) if alarm)
    assert lines[first + 1 :] == lines[: len(lines) - first - 1]
    _, score, alarm = step_sums(np.zeros(2), -30.0, h)
    assert alarm and score < -1.0
