"""Whether values taken on dates change: not, by steps, steadily, or from day to day.

Each of the four has its evidence in closed form, given the scatter of values of one
level, which is integrated over a grid. Before the data, levels scatter in proportion to
it. Steps are those of a product partition: any date may begin a new level.

Source:
    Barry and Hartigan, Annals of Statistics 20 (1992), product partitions; Fearnhead,
    Statistics and Computing 16 (2006), their recursions.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, ndtri, softmax

from hdcal.fleets.model.groups import robust_sd

# Prior probability of each way.
WAYS = {"none": 1 / 2, "steps": 1 / 6, "drift": 1 / 6, "days": 1 / 6}
# Prior sd of a level in scatters of values; the ends of a drift lie twice as far apart.
_LEVELS = 1.5
# Grid of scatters, in the sd of all values.
_GRID = np.geomspace(0.2, 1.6, 25)
# Steps expected before the data.
_EXPECTED = 1.0
# Probability of intervals.
_SURE = 0.95


@dataclass(frozen=True)
class LevelStep:
    """A change of the level.

    Attributes:
        before: index of the last date that lies before it, with 97.5 % probability.
        after: index of the first date that lies after it, likewise.
        size: median, lower and upper end of its 95 % interval.
    """

    before: int
    after: int
    size: tuple[float, float, float]


@dataclass(frozen=True)
class Changes:
    """Posterior of the ways in which values change.

    Attributes:
        ways: probability of each of `WAYS`.
        steps: the likeliest ones, if there are steps.
        drift: from the first date to the last, if it is steady: median, lower and upper
            end of its 95 % interval.
        days_sd: sd of the levels of dates, if each has its own.
    """

    ways: dict[str, float]
    steps: tuple[LevelStep, ...]
    drift: tuple[float, float, float]
    days_sd: float


@dataclass(frozen=True)
class _Sums:
    """Sums of values by date, one row for each scatter of the grid.

    Attributes:
        weight: Σ 1/(τ² + v), cumulated from zero; [scatter, date + 1].
        first: Σ e/(τ² + v) likewise.
        second: Σ e²/(τ² + v) + log(τ² + v) likewise.
        level: variance of levels before the data; [scatter, 1].
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
    """Return whether, how and when values change.

    Args:
        day: index of each value's date, in the order of dates, shape (n,).
        value: shape (n,).
        variance: of each value's error, shape (n,).
        time: of each date, ascending, shape (d,), two or more.
    """
    # One wild value moves neither the median nor the grid.
    value = value - np.median(value)
    sums = _sums(day, value, variance)
    ends = np.arange(len(time) + 1)
    none = sums.segment([0], [len(time)])[:, 0]
    days = sums.segment(ends[:-1], ends[1:]).sum(axis=1)
    steps, begins = _partitions(sums, none)
    place = (time - time[0]) / (time[-1] - time[0]) - 0.5
    drift, slope, slope_variance = _line(sums, place)
    evidence = np.stack([none, steps, drift, days])
    prior = np.log([*WAYS.values()])
    ways = softmax(logsumexp(evidence, axis=1) + prior)
    of_steps, of_drift, of_days = softmax(evidence, axis=1)[1:]
    levels, errors = sums.posterior(ends[:-1], ends[1:])
    # Levels scatter by what their means do and by what these are unsure by.
    scatter = levels.var(axis=1, ddof=1) + errors.mean(axis=1)
    return Changes(
        ways=dict(zip(WAYS, ways.tolist(), strict=True)),
        steps=tuple(_steps(sums, of_steps, of_steps @ begins)),
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


def _partitions(sums: _Sums, none: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the log evidence of one step or more, and where levels begin.

    Returns:
        Log evidence, shape (scatter,), and the probability that a level begins at each
        date, shape (scatter, date).
    """
    scatters, dates = len(none), sums.weight.shape[1] - 1
    begin = min(_EXPECTED / (dates - 1), 0.5)
    go_on, anew = np.log1p(-begin), np.log(begin)
    forward, backward = np.zeros((2, scatters, dates + 1))
    for stop in range(1, dates + 1):
        start = np.arange(stop)
        prior = (stop - start - 1) * go_on + np.where(start > 0, anew, 0.0)
        each = forward[:, :stop] + sums.segment(start, [stop]) + prior
        forward[:, stop] = logsumexp(each, axis=1)
    for start in range(dates - 1, 0, -1):
        stop = np.arange(start + 1, dates + 1)
        prior = (stop - start - 1) * go_on + np.where(stop < dates, anew, 0.0)
        each = backward[:, stop] + sums.segment([start], stop) + prior
        backward[:, start] = logsumexp(each, axis=1)
    # A partition of one level has no step, in the data and before them.
    alone = none + (dates - 1) * go_on
    whole = forward[:, -1]
    steps = whole + np.log(-np.expm1(np.minimum(alone - whole, -1e-12)))
    begins = forward[:, :-1] + anew + backward[:, :-1] - steps[:, None]
    begins = np.exp(np.minimum(begins, 0.0))
    begins[:, 0] = 0.0
    return steps - np.log(-np.expm1((dates - 1) * go_on)), begins


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


def _steps(sums: _Sums, share: np.ndarray, begins: np.ndarray) -> Iterator[LevelStep]:
    """Yield the likeliest steps, each with place and size given the other steps.

    Args:
        sums: of the values.
        share: probability of each scatter.
        begins: probability that a level begins at each date, shape (date,).
    """
    found = _likeliest(sums, int(np.argmax(share))) or [int(np.argmax(begins))]
    ends = [0, *found, len(begins)]
    for start, stop in zip(ends, ends[2:], strict=False):
        place = np.arange(start + 1, stop)
        likely = sums.segment([start], place) + sums.segment(place, [stop])
        weight = share[:, None] * softmax(likely, axis=1)
        within = np.cumsum(weight.sum(axis=0))
        first, last = np.searchsorted(within, [0.5 - 0.5 * _SURE, 0.5 + 0.5 * _SURE])
        (old, old_variance), (new, new_variance) = (
            sums.posterior(*between) for between in (([start], place), (place, [stop]))
        )
        size = _interval(weight, new - old, old_variance + new_variance)
        yield LevelStep(int(place[first]) - 1, int(place[last]), size)


def _likeliest(sums: _Sums, scatter: int) -> list[int]:
    """Return the dates at which levels begin in the likeliest partition."""
    dates = sums.weight.shape[1] - 1
    begin = min(_EXPECTED / (dates - 1), 0.5)
    best, came = np.zeros(dates + 1), np.zeros(dates + 1, int)
    for stop in range(1, dates + 1):
        start = np.arange(stop)
        each = best[:stop] + sums.segment(start, [stop])[scatter]
        each += np.where(start > 0, np.log(begin / (1.0 - begin)), 0.0)
        came[stop] = np.argmax(each)
        best[stop] = each[came[stop]]
    found, at = [], came[-1]
    while at > 0:
        found.insert(0, int(at))
        at = came[at]
    return found


def _interval(share, mean, variance) -> tuple[float, float, float]:
    """Return the interval of a mixture of normals by its mean and its variance."""
    middle = float(np.sum(share * mean))
    sd = np.sqrt(np.sum(share * (variance + (mean - middle) ** 2)))
    half = ndtri(0.5 + 0.5 * _SURE) * sd
    low, high = middle - half, middle + half
    return middle, float(low), float(high)
