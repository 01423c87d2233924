"""The gears of a fleet, each as a case of its own."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hdcal.data.case import Case, require_force
from hdcal.data.gear import at_full_scale
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.prior import scale_of
from hdcal.data.scatter import require_scatter
from hdcal.errors import Finding, InputError, quoted
from hdcal.evidence.row_features import take_rows
from hdcal.fleets.reading.read_fleet import read_fleet, usable
from hdcal.fleets.reading.readings import FleetReadings

# Frequencies of causes need several gears.
_FEWEST = 3
# Rows of a gear beyond those that its stiffness and the offsets of its runs use up.
_FEWEST_LEFT = 8
# Equal readings in a row of a stuck channel, the steps of a force that may repeat where
# a curve is flat, as a share of the range, and the share of its range and of its usual
# step by which the other channel has to move on.
_FEWEST_STUCK, _COARSE, _MOVES, _PACE = 5, 2e-3, 0.1, 0.5


def read_gears(data: Any, gear: Any = None, **how: Any) -> FleetReadings:
    """Return the readings of many gears, read and screened as those of a fleet.

    Raises:
        InputError: holds everything that is wrong with the data as a whole.
    """
    readings = read_fleet(data, gear, all_rows=True, **how)
    require_force(readings.case, "causes")
    return readings


def usable_gears(
    readings: FleetReadings, *, skip_bad: bool = False
) -> tuple[Case, dict[str, Case], dict[str, Finding]]:
    """Return the readings that can show a cause.

    Returns:
        The case of all gears, a case for each, by its label, and the fault of each gear
        that is left out.

    Raises:
        InputError: too few gears are left, or a gear cannot be used.
    """
    # Residuals of a strong effect are not smooth either.
    case = usable(readings, skip_bad=skip_bad, smooth=False).case
    gears = {gear: _one_gear(case, k) for k, gear in enumerate(case.specimen_labels)}
    faults = {label: _fault(gear) for label, gear in gears.items()}
    bad = {label: fault for label, fault in faults.items() if fault is not None}
    left = without_bad(gears, bad, skip_bad=skip_bad)
    return case, left, {**case.left_out, **bad}


def without_bad(
    gears: Mapping[str, Case], bad: Mapping[str, Finding], *, skip_bad: bool
) -> dict[str, Case]:
    """Return the gears that are not bad.

    Raises:
        InputError: a gear is bad and may not be left out, or too few are left.
    """
    left = {label: gear for label, gear in gears.items() if label not in bad}
    if bad and not skip_bad:
        raise InputError([*bad.values(), offer(bad, len(gears))])
    if len(left) < _FEWEST:
        words = f"{len(left)} of {len(gears)} gears can be used"
        remedy = (
            f"Frequencies of causes need {_FEWEST} or more gears, named in a column "
        )
        remedy += "specimen"
        raise InputError([*bad.values(), Finding("data", words, remedy)])
    return left


def _one_gear(case: Case, index: int) -> Case:
    """Return the rows of one gear, with shipped priors at the scale of these rows."""
    records = take_rows(case.records, np.flatnonzero(case.records.specimen == index))
    kept, run = np.unique(records.run, return_inverse=True)
    known = records.known - {"run", "runs", "specimen", "specimens"}
    zeros = np.zeros(len(run), int)
    force, read = np.asarray(records.force), np.asarray(records.deformation)
    scale = scale_of(force, read, case.gear.reading)
    return replace(
        case,
        name=f"{case.name}, gear {quoted(case.specimen_labels[index])}",
        gear=at_full_scale(case.gear, scale),
        records=replace(records, run=run, specimen=zeros, known=known),
        run_labels=tuple(case.run_labels[each] for each in kept),
        specimen_labels=(case.specimen_labels[index],),
        lots=case.lots[index : index + 1],
        operators=(),
        rigs=(),
        dates=(),
    )


def _fault(gear: Case) -> Finding | None:
    """Return why the readings of a gear cannot show a cause."""
    rows, runs = len(gear.records.force), len(gear.run_labels)
    needed = _FEWEST_LEFT + 1 + runs
    if rows < needed:
        words = f"has {rows} rows in {runs} run{'s' if runs > 1 else ''}, too few"
        remedy = f"Take {needed} or more readings, or leave the gear out"
        return Finding(gear.name, words, remedy)
    read, force = np.asarray(gear.records.deformation), np.asarray(gear.records.force)
    units, run = gear.units, np.asarray(gear.records.run)
    load, displacement = (units.load, force), (units.displacement, read)
    for (name, held), (other, moving) in ((load, displacement), (displacement, load)):
        if rows := _stuck(held, moving, run, display=held is force):
            words = f"the {name} is stuck: {rows} equal readings in a row while the "
            words += f"{other} moves on"
            remedy = "Correct the record, or leave the gear out"
            return Finding(gear.name, words, remedy)
    try:
        require_scatter(gear)
    except InputError as error:
        return error.findings[0]
    return None


def _stuck(
    held: np.ndarray, moving: np.ndarray, run: np.ndarray, *, display: bool
) -> int:
    """Return the most equal readings in a row while the other channel moves on, or 0.

    A coarse display repeats readings where the curve is flat, which counts as stuck
    unless `display`. In a hold the other channel may creep, more slowly than before.
    """
    steps, span = np.diff(np.unique(held)), np.ptp(held)
    if not len(steps):
        return 0
    multiples = steps / steps.min()
    coarse = np.allclose(multiples, multiples.round(), rtol=0.0, atol=1e-3)
    if display and coarse and steps.min() > _COARSE * span:
        return 0
    step = np.abs(np.diff(moving))
    pace = _PACE * np.median(step[np.diff(run) == 0])
    # Equal readings of a display differ by less than one of its steps.
    least = max(_MOVES, 2.0 * steps.min() / span) * np.ptp(moving)
    begins = np.r_[True, (np.diff(held) != 0.0) | (np.diff(run) != 0)]
    longest = 0
    for rows in np.split(np.arange(len(held)), np.flatnonzero(begins)[1:]):
        if len(rows) >= _FEWEST_STUCK and (
            np.ptp(moving[rows]) > least and np.median(step[rows[:-1]]) > pace
        ):
            longest = max(longest, len(rows))
    return longest
