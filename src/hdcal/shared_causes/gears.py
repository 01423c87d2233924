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
from hdcal.screening.channels import longest_stuck

# Frequencies of causes need several gears.
_FEWEST = 3
# Rows of a gear beyond those that its stiffness and the offsets of its runs use up.
_FEWEST_LEFT = 8


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
        remedy = f"Frequencies of causes need {_FEWEST} or more gears, named in a "
        remedy += "column specimen"
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
        if rows := longest_stuck(held, moving, run, display=held is force):
            words = f"the {name} is stuck: {rows} equal readings in a row while the "
            words += f"{other} moves on"
            remedy = "Correct the record, or leave the gear out"
            return Finding(gear.name, words, remedy)
    try:
        require_scatter(gear)
    except InputError as error:
        return error.findings[0]
    return None
