"""Test for change over time: no change, steps, linear drift, or day-to-day scatter.

The evidence of each of the four has a closed form given the scatter of values of one
level, which is integrated over a grid. Before the data, levels scatter in proportion to
it. Steps are those of a product partition: any date may begin a new level.

Source:
    Barry and Hartigan, Annals of Statistics 20 (1992), product partitions; Fearnhead,
    Statistics and Computing 16 (2006), their recursions.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, ndtri, softmax

from hdcal.fleets.model.groups import robust_sd
from hdcal.report.item import TAILS, Interval

# Prior probability of each way.
WAYS = {"none": 1 / 2, "steps": 1 / 6, "drift": 1 / 6, "days": 1 / 6}
# Prior sd of a level in scatters of values; the ends of a drift lie twice as far apart.
_LEVELS = 1.5
# Grid of scatters, in the sd of all values.
_GRID = np.geomspace(0.2, 1.6, 25)
# Steps expected before the data.
_EXPECTED = 1.0


class LevelStep(NamedTuple):
    """Change of the level between two dates, by their indices, each 97.5 % certain."""

    before: int
    after: int
    size: Interval


class Changes(NamedTuple):
    """Probability of each of `WAYS`, and what changes if values change in that way.

    The drift is that from the first date to the last, the sd that of levels of dates.
    """

    ways: dict[str, float]
    steps: list[LevelStep]
    drift: Interval
    days_sd: float


class _Sums(NamedTuple):
    """Sums over values of variance w = τ² + v, by the scatter τ, cumulated over dates.

    Σ 1/w, Σ e/w and Σ e²/w + log w, [scatter, date + 1]; and the variance of levels
    before the data, [scatter, 1].
    """

    weight: np.ndarray
    first: np.ndarray
    second: np.ndarray
    level: np.ndarray

    def segment(self, start, stop) -> np.ndarray:
        """Return the log evidence of one level from dates on to others."""
        mean, variance = self.posterior(start, stop)
        second = self.second[:, stop] - self.second[:, start]
        return 0.5 * (mean**2 / variance + np.log(variance / self.level) - second)

    def posterior(self, start, stop) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance of such levels."""
        weight = self.weight[:, stop] - self.weight[:, start]
        variance = self.level / (1.0 + self.level * weight)
        return variance * (self.first[:, stop] - self.first[:, start]), variance


def changes(
    day: np.ndarray, value: np.ndarray, variance: np.ndarray, time: np.ndarray
) -> Changes:
    """Return whether, how and when values (n,) with errors of a variance change.

    `day` is the index of each value's date, `time` of each date ascends, (d,).
    """
    # One outlier moves neither the median nor the grid.
    value = value - np.median(value)
    sums = _sums(day, value, variance)
    ends = np.arange(len(time) + 1)
    none = sums.segment([0], [len(time)])[:, 0]
    days = sums.segment(ends[:-1], ends[1:]).sum(axis=1)
    segments, unchanged = _segments(sums)
    partitions = _partitions(segments)
    # A partition of one level has no step, in the data and before them.
    steps = partitions[:, -1] - np.log(-np.expm1(unchanged))
    alone = np.minimum(none + unchanged - partitions[:, -1], -1e-12)
    steps += np.log(-np.expm1(alone))
    place = (time - time[0]) / (time[-1] - time[0]) - 0.5
    drift, slope, slope_variance = _line(sums, place)
    evidence = np.stack([none, steps, drift, days])
    ways = softmax(logsumexp(evidence, axis=1) + np.log([*WAYS.values()]))
    of_steps, of_drift, of_days = softmax(evidence, axis=1)[1:]
    likeliest = np.argmax(of_steps)
    found = _ends(partitions[likeliest], segments[likeliest])
    levels, errors = sums.posterior(ends[:-1], ends[1:])
    # Levels scatter by what their means do and by what these are unsure by.
    scatter = levels.var(axis=1, ddof=1) + errors.mean(axis=1)
    return Changes(
        ways=dict(zip(WAYS, ways.tolist(), strict=True)),
        steps=[*_steps(sums, of_steps, found)],
        drift=_interval(of_drift, slope, slope_variance),
        days_sd=float(np.sqrt(of_days @ scatter)),
    )


def _sums(day: np.ndarray, value: np.ndarray, variance: np.ndarray) -> _Sums:
    spread = robust_sd(value) or np.std(value)
    scatter = _GRID[:, None] * max(float(spread), np.finfo(float).tiny ** 0.25)
    total = scatter**2 + variance
    parts = 1.0 / total, value / total, value**2 / total + np.log(total)
    dates = int(day.max()) + 1
    weight, first, second = (
        np.cumsum([[0.0, *np.bincount(day, row, dates)] for row in part], axis=1)
        for part in parts
    )
    return _Sums(weight, first, second, (_LEVELS * scatter) ** 2)


def _segments(sums: _Sums) -> tuple[np.ndarray, float]:
    """Return log prior and evidence of levels, [scatter, start, stop], prior of one."""
    scatters, ends = sums.weight.shape
    begin = min(_EXPECTED / (ends - 2), 0.5)
    found = np.full((scatters, ends, ends), -np.inf)
    for stop in range(1, ends):
        start = np.arange(stop)
        prior = (stop - start - 1) * np.log1p(-begin)
        prior += np.where(start > 0, np.log(begin), 0.0)
        found[:, :stop, stop] = sums.segment(start, [stop]) + prior
    return found, (ends - 2) * float(np.log1p(-begin))


def _partitions(segments: np.ndarray) -> np.ndarray:
    """Return log prior and evidence of all partitions, [scatter, stop]."""
    scatters, ends, _ = segments.shape
    found = np.zeros((scatters, ends))
    for stop in range(1, ends):
        each = found[:, :stop] + segments[:, :stop, stop]
        found[:, stop] = logsumexp(each, axis=1)
    return found


def _ends(partitions: np.ndarray, segments: np.ndarray) -> list[int]:
    """Return the ends of the likeliest levels, from the last one back."""
    ends = [len(partitions) - 1]
    while ends[0] > 0:
        start = np.arange(ends[0])
        ends.insert(0, int(np.argmax(partitions[start] + segments[start, ends[0]])))
    if len(ends) == 2:
        ends.insert(1, 1 + int(np.argmax(segments[0, 1:-1] + segments[1:-1, -1])))
    return ends


def _line(sums: _Sums, place: np.ndarray):
    """Return the log evidence of a straight line, its slope and its variance."""
    weight, first = np.diff(sums.weight), np.diff(sums.first)
    level = sums.level[:, 0]
    steep = 4.0 * level
    a = weight.sum(axis=1) + 1.0 / level
    b = weight @ place
    c = weight @ place**2 + 1.0 / steep
    determinant = a * c - b**2
    p, q = first.sum(axis=1), first @ place
    square = (c * p**2 - 2.0 * b * p * q + a * q**2) / determinant
    evidence = 0.5 * (square - np.log(determinant * level * steep) - sums.second[:, -1])
    return evidence, (a * q - b * p) / determinant, a / determinant


def _steps(sums: _Sums, share: np.ndarray, ends: list[int]) -> Iterator[LevelStep]:
    """Yield steps between levels with these ends, given the share of each scatter."""
    for start, stop in zip(ends, ends[2:], strict=False):
        place = np.arange(start + 1, stop)
        likely = sums.segment([start], place) + sums.segment(place, [stop])
        weight = share[:, None] * softmax(likely, axis=1)
        within = np.cumsum(weight.sum(axis=0))
        first, last = np.searchsorted(within, [TAILS[0], TAILS[2]])
        old, old_variance = sums.posterior([start], place)
        new, new_variance = sums.posterior(place, [stop])
        size = _interval(weight, new - old, old_variance + new_variance)
        yield LevelStep(int(place[first]) - 1, int(place[last]), size)


def _interval(share, mean, variance) -> Interval:
    """Return the interval of a mixture of normals by its mean and its variance."""
    middle = float(np.sum(share * mean))
    sd = np.sqrt(np.sum(share * (variance + (mean - middle) ** 2)))
    half = float(ndtri(TAILS[2]) * sd)
    return Interval(median=middle, lo=middle - half, hi=middle + half)
