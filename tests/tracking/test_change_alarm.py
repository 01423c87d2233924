"""False alarms of the change alarm are as frequent as stated."""

import numpy as np
import pytest

from hdcal.tracking.change_alarm import (
    ALLOWANCE,
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


def simulated(h: float, seed: int, streams: int = 3000, longest: int = 4000):
    """Rows until each of many streams without a change raises an alarm."""
    rng, up, down = np.random.default_rng(seed), np.zeros(streams), np.zeros(streams)
    called = np.zeros(streams, dtype=int)
    for row in range(1, longest + 1):
        z = rng.normal(size=streams)
        up = np.maximum(0.0, up + z - ALLOWANCE)
        down = np.maximum(0.0, down - z - ALLOWANCE)
        called[(called == 0) & (np.maximum(up, down) > h)] = row
        if called.all():
            break
    return called


def test_false_alarms_come_at_the_stated_rate():
    rows = 200.0
    called = simulated(threshold_for(rows), 1)
    assert called.all()
    error = called.std() / np.sqrt(len(called))
    assert abs(called.mean() - rows) < 4.0 * error
    # A threshold that leaves out the second side, or takes a fixed h, is flagged.
    for wrong in (threshold_for(rows / 2.0), 5.0):
        called = simulated(wrong, 2)
        assert abs(called[called > 0].mean() - rows) > 4.0 * error


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
