"""Changes with the date are found, named and dated, and no others."""

from itertools import product

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from hdcal.fleets import change_points
from hdcal.fleets.change_points import changes

SD, ERROR = 1.0, 0.3
# Shares of repeated sets in which a change may be reported falsely, and must be found.
FALSE, FOUND = 0.05, 0.9


def measured(rng, kind, many=60, dates=20, size=2.5):
    """Return days, values, variances of their errors, and dates."""
    day = np.sort(np.append(rng.integers(0, dates, many - dates), np.arange(dates)))
    value = rng.normal(0.0, np.hypot(SD, ERROR), many)
    if kind == "steps":
        value += size * (day >= dates // 2)
    if kind == "drift":
        value += 1.5 * size * day / (dates - 1)
    if kind == "days":
        value += size * rng.standard_normal(dates)[day]
    return day, value, np.full(many, ERROR**2), np.arange(float(dates))


def repeated(kind, count=60, **size):
    rng = np.random.default_rng(4)
    return [changes(*measured(rng, kind, **size)) for _ in range(count)]


@pytest.mark.parametrize("size", [{"many": 12, "dates": 4}, {}, {"many": 200}])
def test_no_change_is_reported_where_none_is(size):
    false = [found.ways["none"] < 0.05 for found in repeated("none", **size)]
    assert np.mean(false) <= FALSE


@pytest.mark.parametrize("kind", ["steps", "drift", "days"])
def test_a_change_is_found_and_named(kind):
    found = repeated(kind, many=200)
    assert np.mean([each.ways["none"] < 0.05 for each in found]) >= FOUND
    likeliest = [max(each.ways, key=lambda way: each.ways[way]) for each in found]
    assert np.mean([way == kind for way in likeliest]) >= FOUND


def test_the_size_and_the_date_of_a_step_are_within_their_intervals():
    dated, sized = [], []
    for found in repeated("steps", many=200):
        if len(found.steps) == 1:
            step = found.steps[0]
            dated.append(step.before < 10 <= step.after)
            sized.append(step.size.lo < 2.5 < step.size.hi)
    assert len(dated) > 48
    assert np.mean(dated) >= 0.9
    assert np.mean(sized) >= 0.88


def test_the_sizes_of_drifts_and_of_days_are_those_of_the_values():
    drifts = [each.drift for each in repeated("drift")]
    assert np.mean([each.lo < 3.75 < each.hi for each in drifts]) >= 0.88
    assert np.mean([each.median for each in drifts]) == pytest.approx(3.75, rel=0.1)
    # Three in four of 60 values are as precise as two levels of 20 each.
    assert np.median([each.hi - each.lo for each in drifts]) < 3.0
    found = [each.days_sd for each in repeated("days", size=2.5)]
    assert np.mean(found) == pytest.approx(2.5, rel=0.1)


def test_two_steps_are_distinguished():
    rng, held = np.random.default_rng(1), []
    for _ in range(30):
        day, value, variance, time = measured(rng, "none", many=120, dates=30)
        value += 4.0 * ((day >= 10) & (day < 20))
        steps = changes(day, value, variance, time).steps
        assert [np.sign(step.size.median) for step in steps] == [1.0, -1.0]
        held += [
            s.before < at <= s.after for s, at in zip(steps, (10, 20), strict=True)
        ]
    assert np.mean(held) >= 0.9


def test_evidences_are_those_of_dense_covariances():
    """Every partition is a normal density of all values."""
    rng = np.random.default_rng(2)
    day, value, variance, time = measured(rng, "steps", many=9, dates=4, size=1.0)
    value = value - np.median(value)
    sums = change_points._sums(day, value, variance)
    segments, unchanged = change_points._segments(sums)
    scatter = np.sqrt(sums.level[:, 0]) / change_points._LEVELS
    begin = change_points._EXPECTED / (len(time) - 1)
    none = sums.segment([0], [4])[:, 0]
    every = change_points._partitions(segments)[:, -1]
    line = change_points._line(sums, np.linspace(-0.5, 0.5, 4))[0]
    offset = 0.5 * len(value) * np.log(2.0 * np.pi)
    for row in (0, 12, 24):
        own = np.diag(scatter[row] ** 2 + variance)
        level = sums.level[row, 0]
        parts = []
        for cuts in product([False, True], repeat=3):
            ends = [0, *(np.flatnonzero(cuts) + 1), 4]
            group = np.searchsorted(ends[1:-1], day, side="right")
            same = group[:, None] == group
            law = multivariate_normal(cov=own + level * same)
            chance = np.prod([begin if cut else 1.0 - begin for cut in cuts])
            parts.append(law.logpdf(value) + np.log(chance))
        assert unchanged == pytest.approx(3.0 * np.log(1.0 - begin))
        assert none[row] - offset == pytest.approx(parts[0] - unchanged)
        assert every[row] - offset == pytest.approx(logsumexp(parts))
        place = np.linspace(-0.5, 0.5, 4)[day]
        slope = multivariate_normal(
            cov=own + level * (1.0 + 4.0 * np.outer(place, place))
        )
        assert line[row] - offset == pytest.approx(slope.logpdf(value))
