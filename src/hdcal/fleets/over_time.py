"""Whether a fleet changes with the date: its stiffness, its zeros and its noise."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from hdcal.fleets.change_points import Changes, changes, middle_sd
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.groups import groups
from hdcal.report.answer import Count, Probability, Promise, Real, Words
from hdcal.report.intervals import Interval

# Probability from which a change is told.
CHANGED = 0.95
# Days apart are told up to so many; more of them are taken together.
_MOST_DATES = 400
# A value so many sds from those measured before and after it says nothing of dates.
_WILD, _BESIDE = 4.0, 3

Unit = Literal["percent", "N"]
Way = Literal["steps", "drift", "days"]
What = Literal["stiffness", "zero", "noise"]
Date = Annotated[str, Promise(pattern=r"^\d{4}-\d{2}-\d{2}$")]


@dataclass(frozen=True)
class StepAnswer:
    """A step between two dates, given the others; 95 % intervals of date and size."""

    after: Date
    before: Date
    size: Interval


@dataclass(frozen=True, kw_only=True)
class TimeAnswer:
    """How one quantity goes with the date of measurement.

    Attributes:
        what: stiffness of gears about the centre of their lot, zero of a gear's
            mountings of one day about that of their operator, or noise of gears.
        unit: percent or N.
        dates: how many there are.
        first: the first of them.
        last: likewise.
        probability_changed: that it changes at all, one half before the data.
        changed: whether that is 0.95 or more.
        ways: probability of steps, of a steady drift, and of levels that differ from
            day to day.
        likeliest: of these.
        steps: if there are steps.
        drift: from the first date to the last, if it is steady.
        days_sd: by which days differ, if they do.
        left_out: measurements far from those before and after them.
    """

    what: What
    unit: Unit
    dates: Count
    first: Date
    last: Date
    probability_changed: Probability
    changed: bool
    ways: dict[str, Probability]
    likeliest: Way
    steps: tuple[StepAnswer, ...]
    drift: Interval
    days_sd: Real
    left_out: tuple[Words, ...]


@dataclass(frozen=True)
class TimeSeries:
    """Values in the order in which they were measured; all of shape (n,) but names.

    Attributes:
        what: they are of.
        unit: of them.
        day: of measurement.
        name: of the gear.
        value: about the middle of all.
        sd: of their errors.
        apart: whether it is far from those before and after it.
    """

    what: What
    unit: Unit
    day: np.ndarray
    name: np.ndarray
    value: np.ndarray
    sd: np.ndarray
    apart: np.ndarray


def time_series(found: Fleet) -> list[TimeSeries]:
    """Return what was measured on several dates; nothing where they are not told."""
    if not found.case.dates or found.reasons:
        return []
    each = (_ordered(*one) for one in _measured(found))
    return [one for one in each if len(np.unique(one.day[~one.apart])) > 1]


def time_answer(series: TimeSeries) -> TimeAnswer:
    """Return how values go with their date."""
    kept = ~series.apart
    days, index = np.unique(series.day[kept], return_inverse=True)
    together = -(-len(days) // _MOST_DATES)
    days, index = days[::together], index // together
    time = (days - days[0]).astype(float)
    about = changes(index, series.value[kept], series.sd[kept] ** 2, time)
    some = 1.0 - about.ways["none"]
    ways: dict[str, float] = {n: p for n, p in about.ways.items() if n != "none"}
    likeliest = max(("steps", "drift", "days"), key=lambda way: ways[way])
    return TimeAnswer(
        what=series.what,
        unit=series.unit,
        dates=len(days),
        first=str(days[0]),
        last=str(days[-1]),
        probability_changed=some,
        changed=some >= CHANGED,
        ways=ways,
        likeliest=likeliest,
        steps=tuple(_dated(about, days)),
        drift=Interval(*about.drift),
        days_sd=about.days_sd,
        left_out=tuple(series.name[series.apart].tolist()),
    )


def _dated(about: Changes, days: np.ndarray) -> Iterator[StepAnswer]:
    for step in about.steps:
        after, before = str(days[step.before]), str(days[step.after])
        yield StepAnswer(after, before, Interval(*step.size))


def _ordered(what: What, unit: Unit, day, name, value, sd) -> TimeSeries:
    told = ~np.isnat(day) & np.isfinite(value)
    order = np.flatnonzero(told)[np.argsort(day[told], kind="stable")]
    value = value[order] - np.median(value[order]) if len(order) else value[order]
    columns = day[order].astype("datetime64[D]"), name[order], value, sd[order]
    return TimeSeries(what, unit, *columns, _wild(value, sd[order]))


def _wild(value: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Return which values are far from those before and after them, each alone.

    Source:
        Hampel, The American Statistician 25 (1971); the filter that bears his name.
    """
    if len(value) <= 2 * _BESIDE:
        return np.zeros(len(value), bool)
    padded = np.pad(value, _BESIDE, mode="reflect")
    beside = np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1)
    apart = value - np.median(np.delete(beside, _BESIDE, axis=1), axis=1)
    # What values scatter by beside their own errors.
    scatter = max(middle_sd(apart) ** 2 - float(np.median(sd**2)), 0.0)
    apart = apart / np.sqrt(scatter + sd**2)
    wild = np.abs(apart) > _WILD * middle_sd(apart)
    # Neighbours that are far on one side are a change, or a bad day.
    side = np.pad(np.where(wild, np.sign(apart), 0.0), 1)
    return wild & (side[1:-1] != side[:-2]) & (side[1:-1] != side[2:])


def _by_day(gears, dates, zero, sums, noise, own_xx, labels):
    """Return date, name, zero and its sd of each gear on each day.

    Zeros of a gear share the error of its slope: those of one day are one value.
    """
    days = dates.astype("datetime64[D]")
    keys = np.stack([gears, days.astype(np.int64)])
    pairs, index = np.unique(keys, axis=1, return_inverse=True)
    index = index.ravel()
    rows = np.bincount(index, sums.rows)
    mean = np.bincount(index, sums.rows * zero) / rows
    x = np.bincount(index, sums.rows * sums.x) / rows
    gear = pairs[0]
    sd = noise[np.unique(index, return_index=True)[1]]
    error = sd * np.sqrt(1.0 / rows + x**2 / own_xx[gear])
    return pairs[1].astype("datetime64[D]"), labels[gear], mean, error


def _measured(found: Fleet):
    """Yield what goes with the date: what, unit, date, name, value and sd."""
    case, runs = found.case, found.readings.runs
    sums = found.readings.on_one_rig(found.draws).sums
    gears = np.asarray(sums.gear)
    dates = np.array([date or "NaT" for date in case.dates], "datetime64[s]")[runs]
    # A gear has the date of the first of its mountings that has one.
    of_gear = np.full(len(found.off), np.datetime64("NaT", "s"))
    np.fmin.at(of_gear, gears, dates)
    labels = np.array(case.specimen_labels)
    own_xx = np.bincount(gears, sums.xx)
    slope = np.bincount(gears, sums.xy) / own_xx
    middle = {name: np.median(values) for name, values in found.draws.items()}
    lot = groups(case.lots)[1] if found.lots else np.zeros(len(labels), int)
    centre = middle["stiffness"] * (1.0 + np.asarray(group_offsets(middle, "lot"))[lot])
    sd = found.noise_sd / np.sqrt(own_xx)
    percent = 100.0 * (slope / centre - 1.0), 100.0 * sd / centre
    yield "stiffness", "percent", of_gear, labels, *percent
    by = np.asarray(group_offsets(middle, "operator"))[np.asarray(sums.operator)]
    # By the gear's own line: the population's law of zeros would draw them together.
    zero = sums.y - slope[gears] * sums.x - by
    noise = found.noise_sd[gears]
    yield "zero", "N", *_by_day(gears, dates, zero, sums, noise, own_xx, labels)
    square = np.bincount(gears, sums.yy) - slope**2 * own_xx
    free = np.bincount(gears, sums.rows - 1.0) - 1.0
    with np.errstate(all="ignore"):
        told = square / free > 0.0
        # Beside loop and bend: of a change of shape it is no change of noise.
        noise = np.where(told, 100.0 * np.log(found.own_noise_sd), np.nan)
        yield "noise", "percent", of_gear, labels, noise, 100.0 / np.sqrt(2.0 * free)
