"""Stiffness, zero and noise of a fleet against the date: do they change, and when?"""

from typing import Annotated, Any, Literal, get_args

import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf

from hdcal.fleets.change_points import changes
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.report.item import Count, Interval, Item, Probability, Words

# Probability from which on a change is reported.
CHANGED = 0.95
# More dates than this are grouped.
_MOST_DATES = 400

Way = Literal["steps", "drift", "days"]
Date = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]


class LevelChange(Item):
    """A step between two dates, given the other steps; 95 % intervals."""

    after: Date
    before: Date
    size: Interval


class Change(Item):
    """How one quantity depends on the date of measurement.

    Attributes:
        probability_changed: that it changes at all, 0.5 before the data.
        drift: from the first date to the last, if it is steady.
        days_sd: sd of the levels of days, if they differ from day to day.
        left_out: flagged gears between others, which are no change.
        values: gear, day, value about the median, sd of its error, left_out.
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
    values: InstanceOf[pd.DataFrame] = Field(exclude=True)


def over_time(readings: FleetReadings, fit: FittedFleet) -> tuple[Change, ...]:
    """Return the changes of each quantity; none if all is of one date or has none."""
    if not readings.case.dates:
        return ()
    units = {"stiffness": "%", "zero": readings.case.units.load_unit, "noise": "%"}
    tables = _measured(readings, fit).items()
    found = (_change(what, units[what], values) for what, values in tables)
    return tuple(change for change in found if change is not None)


def _measured(readings: FleetReadings, fit: FittedFleet) -> dict[str, pd.DataFrame]:
    """Return stiffness [%] and noise [%] of gears, and their zeros on days."""
    # The population would shrink them towards each other: they are of each gear alone.
    case, sums, groups, fits = readings.case, readings.sums, fit.groups, fit.fits
    middle = {name: np.median(values) for name, values in fit.draws.items()}
    kinds = "lot", "rig", "operator"
    lots, gains, operators = (np.asarray(group_offsets(middle, k)) for k in kinds)
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
    free = np.where(fits.freedom > 0.0, fits.freedom, np.nan)

    # Zeros of a gear share the error of its slope: those of one day are one value.
    keys = np.stack([sums.gear, day.astype(np.int64)])
    (gear, on_day), at = np.unique(keys, axis=1, return_inverse=True)
    at = at.ravel()
    rows, x = np.bincount(at, sums.rows), gain[groups.rig] * sums.mean[:, 0]
    zero = readings.side * (sums.mean[:, 3] - slope[sums.gear] * x)
    zero -= operators[groups.operator]
    mean_x, mean_zero = (np.bincount(at, sums.rows * v) / rows for v in (x, zero))
    error = np.sqrt(fits.widening / rows + mean_x**2 / weight[gear])

    percent, every = 100.0 / centre, np.arange(gears)
    stiffness = percent * (slope - centre), percent * noise / np.sqrt(weight)
    spread = 100.0 * fits.log_sd, 100.0 / np.sqrt(2.0 * free)
    zero = mean_zero, noise[gear] * error
    of_quantity = {
        "stiffness": (every, first, *stiffness),
        "zero": (gear, on_day.view("M8[D]"), *zero),
        "noise": (every, first, *spread),
    }
    labels = np.array(case.specimen_labels)
    return {
        name: _dated(labels[of], fit.flagged(name)[of], *columns)
        for name, (of, *columns) in of_quantity.items()
    }


def _dated(gear, flagged, day, value, sd) -> pd.DataFrame:
    """Return values that have a date, about their median, in the order of the dates."""
    columns = {"gear": gear, "day": day, "value": value, "sd": sd, "flagged": flagged}
    table = pd.DataFrame(columns).dropna().sort_values("day", kind="stable")
    table["value"] -= table["value"].median()
    flags = np.pad(table.pop("flagged").to_numpy(), 1)
    # Several flagged gears in a row may be a change.
    table["left_out"] = flags[1:-1] & ~flags[:-2] & ~flags[2:]
    return table.reset_index(drop=True)


def _change(what, unit: str, values: pd.DataFrame) -> Change | None:
    """Return how values change; None if they are of one date."""
    kept: Any = values[~values["left_out"]]
    days, index = np.unique(kept["day"].to_numpy("M8[D]"), return_inverse=True)
    if len(days) < 2:
        return None
    together = -(-len(days) // _MOST_DATES)
    first = days[::together]
    last = np.append(days[together - 1 : -1 : together], days[-1])
    time = (first - first[0]).astype(float)
    variance = kept["sd"].to_numpy() ** 2
    found = changes(index // together, kept["value"].to_numpy(), variance, time)
    ways: dict[Way, float] = {way: found.ways[way] for way in get_args(Way)}
    chance = 1.0 - found.ways["none"]
    return Change(
        what=what,
        unit=unit,
        dates=len(days),
        first=str(days[0]),
        last=str(days[-1]),
        probability_changed=chance,
        changed=chance >= CHANGED,
        ways=ways,
        likeliest=max(ways, key=ways.__getitem__),
        steps=tuple(
            LevelChange(
                # The step may lie within a group.
                after=str(first[step.before]),
                before=str(last[step.after]),
                size=step.size,
            )
            for step in found.steps
        ),
        drift=found.drift,
        days_sd=found.days_sd,
        left_out=tuple(values["gear"][values["left_out"]]),
        values=values,
    )
