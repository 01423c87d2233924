"""Stiffness, zero and noise of a fleet against the date: do they change, and when?"""

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field, InstanceOf

from hdcal.fleets.change_points import changes
from hdcal.fleets.model.gear_quantity import MOST_FALSE
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.line_fits import line_fits
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.model.quantities import FleetGroups
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.report.item import Count, Interval, Item, Probability, Words

# Probability from which on a change is reported.
CHANGED = 0.95
# More dates than this are grouped.
_MOST_DATES = 400

Way = Literal["steps", "drift", "days"]
Date = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]


@dataclass(frozen=True)
class Dated:
    """Values with their dates; all of shape (n,).

    Attributes:
        day: of measurement.
        gear: that was measured.
        value: of the quantity.
        sd: of the error of the value.
        left_out: whether it is of a flagged gear, and those before and after it not.
    """

    day: np.ndarray
    gear: np.ndarray
    value: np.ndarray
    sd: np.ndarray
    left_out: np.ndarray

    @classmethod
    def of(cls, day, gear, value, sd, odd) -> "Dated":
        """Return values about their median in the order of the dates."""
        known = np.flatnonzero(~np.isnat(day) & np.isfinite(value) & np.isfinite(sd))
        order = known[np.argsort(day[known], kind="stable")]
        value, sd = value[order], sd[order]
        value = value - np.median(value) if len(value) else value
        return cls(day[order], gear[order], value, sd, _alone(odd[order]))


class LevelChange(Item):
    """A step between two dates, given the other steps; 95 % intervals."""

    after: Date
    before: Date
    size: Interval


class Change(Item):
    """How one quantity depends on the date of measurement.

    Attributes:
        what: stiffness of gears about the centre of their lot, zero of the mountings of
            a gear on one day about that of their operator, or noise of gears.
        unit: of its values.
        dates: number of dates.
        first: the first of them.
        last: the last of them.
        probability_changed: that it changes at all, 0.5 before the data.
        changed: whether that is 0.95 or more.
        ways: probability of steps, of a steady drift, and of levels that differ from
            day to day.
        likeliest: the most probable of these.
        steps: if there are steps.
        drift: from the first date to the last, if it is steady.
        days_sd: sd of the days, if they differ.
        left_out: flagged gears between others, which are no change.
        values: about the median of all, in the order of the dates.
    """

    what: Literal["stiffness", "zero", "noise"]
    unit: str
    dates: Count
    first: Date
    last: Date
    probability_changed: Probability
    changed: bool
    ways: dict[Way, Probability]
    likeliest: Way
    steps: tuple[LevelChange, ...]
    drift: Interval
    days_sd: float
    left_out: tuple[Words, ...]
    values: InstanceOf[Dated] = Field(exclude=True)


def over_time(readings: FleetReadings, fit: FittedFleet) -> tuple[Change, ...]:
    """Return the changes of each quantity; none if all is of one date or has none."""
    if not readings.case.dates:
        return ()
    percent, load_unit = "%", readings.case.units.load_unit
    units = {"stiffness": percent, "zero": load_unit, "noise": percent}
    each = zip(units.items(), _measured(readings, fit), strict=True)
    return tuple(_change(*named, v) for named, v in each if _dates(v).size > 1)


def _measured(readings: FleetReadings, fit: FittedFleet) -> tuple[Dated, Dated, Dated]:
    """Return the stiffness of gears [%], the zero on days, and the noise of gears [%].

    They follow from the lines of each gear alone: the population would shrink them
    towards each other.
    """
    case, sums = readings.case, readings.sums
    middle = {name: np.median(values) for name, values in fit.draws.items()}
    lots, gains, operators = (
        np.asarray(group_offsets(middle, kind)) for kind in ("lot", "rig", "operator")
    )
    groups = FleetGroups.of(case, sums.run)
    fits = line_fits(sums, groups.rig, readings.step)
    gears, gain = len(groups.lot), 1.0 + gains
    weight = gain[fits.rig] ** 2 / fits.slope_error
    pull = np.bincount(fits.gear, weight * fits.slope / gain[fits.rig], gears)
    weight = np.bincount(fits.gear, weight, gears)
    slope, noise = pull / weight, fit.gears["noise_sd_N"].to_numpy()
    centre = middle["stiffness"] * (1.0 + lots[groups.lot])
    dates = np.array([date or "NaT" for date in case.dates], "datetime64[s]")
    day = dates.astype("datetime64[D]")[sums.run]
    # A gear has the date of the first of its mountings that has one.
    first = np.full(gears, np.datetime64("NaT", "D"))
    np.fmin.at(first, sums.gear, day)
    labels = np.array(case.specimen_labels)
    odd = {
        name: 1.0 - fit.gears[f"off_{name}"].to_numpy() <= MOST_FALSE
        for name in ("stiffness", "zero", "noise")
    }
    stiffness = Dated.of(
        first,
        labels,
        100.0 * (slope / centre - 1.0),
        100.0 * noise / (centre * np.sqrt(weight)),
        odd["stiffness"],
    )
    free = np.where(fits.freedom > 0.0, fits.freedom, np.nan)
    log_sd = 100.0 * fits.log_sd
    error = 100.0 / np.sqrt(2.0 * free)
    spread = Dated.of(first, labels, log_sd, error, odd["noise"])

    # Zeros of a gear share the error of its slope: those of one day are one value.
    keys = np.stack([sums.gear, day.astype(np.int64)])
    (gear, _), at = np.unique(keys, axis=1, return_inverse=True)
    at = at.ravel()
    rows, x = np.bincount(at, sums.rows), gain[groups.rig] * sums.mean[:, 0]
    zero = readings.side * (sums.mean[:, 3] - slope[sums.gear] * x)
    zero -= operators[groups.operator]
    mean_x, mean_zero = (np.bincount(at, sums.rows * v) / rows for v in (x, zero))
    widening = (1.0 + fit.correlation) / (1.0 - fit.correlation)
    error = np.sqrt(widening / rows + mean_x**2 / weight[gear])
    on_day = day[np.unique(at, return_index=True)[1]]
    error, is_odd = noise[gear] * error, odd["zero"][gear]
    zeros = Dated.of(on_day, labels[gear], mean_zero, error, is_odd)
    return stiffness, zeros, spread


def _dates(values: Dated) -> np.ndarray:
    return np.unique(values.day[~values.left_out])


def _change(what, unit: str, values: Dated) -> Change:
    kept, days = ~values.left_out, _dates(values)
    together = -(-len(days) // _MOST_DATES)
    index = np.searchsorted(days, values.day[kept]) // together
    days = days[::together]
    time = (days - days[0]).astype(float)
    found = changes(index, values.value[kept], values.sd[kept] ** 2, time)
    ways: dict[Way, float] = {way: found.ways[way] for way in get_args(Way)}
    return Change(
        what=what,
        unit=unit,
        dates=len(days),
        first=str(days[0]),
        last=str(days[-1]),
        probability_changed=1.0 - found.ways["none"],
        changed=1.0 - found.ways["none"] >= CHANGED,
        ways=ways,
        likeliest=max(ways, key=ways.__getitem__),
        steps=tuple(
            LevelChange(
                after=str(days[step.before]),
                before=str(days[step.after]),
                size=_interval(step.size),
            )
            for step in found.steps
        ),
        drift=_interval(found.drift),
        days_sd=found.days_sd,
        left_out=tuple(values.gear[values.left_out].tolist()),
        values=values,
    )


def _interval(ends: tuple[float, float, float]) -> Interval:
    median, lo, hi = ends
    return Interval(median=median, lo=lo, hi=hi)


def _alone(odd: np.ndarray) -> np.ndarray:
    """Return odd values between others: several in a row may be a change."""
    beside = np.pad(odd, 1)
    return odd & ~beside[:-2] & ~beside[2:]
