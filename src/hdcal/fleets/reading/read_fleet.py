"""Reading of many gears from any source, without those whose record has a fault."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.case import Case
from hdcal.data.findings import LISTED
from hdcal.data.gear import at_full_scale
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.measurements.folder import read_gear_folder
from hdcal.data.measurements.gear_files import gear_files
from hdcal.data.measurements.parquet import open_parquet
from hdcal.data.measurements.screened import screening_notes
from hdcal.data.prior import scale_of
from hdcal.data.reading import read_case
from hdcal.data.scatter import require_scatter
from hdcal.data.tables.parquet_files import is_parquet
from hdcal.errors import Finding, Findings, InputError, quoted
from hdcal.fleets.reading.gear_sizes import gear_sizes
from hdcal.fleets.reading.parquet_readings import parquet_readings
from hdcal.fleets.reading.readings import FleetReadings, fleet_readings
from hdcal.fleets.reading.record_faults import faults_among_gears
from hdcal.screening.result import Observation

# Findings of screening that make a gear faulty; others are dealt with, and noted.
_FAULTS = {
    "after the largest force": "permanent drop of the {load}",
    "jump of both": "jump of {load} and {displacement}",
    "jump of the deformation": "jump of the {displacement}",
    "jump of the force": "jump of the {load}",
    "saturation of the deformation": "saturation of the {displacement}",
    "saturation of the force": "saturation of the {load}",
}
# Notes on records that are listed.
_LISTED = 20
# From fewer gears next to nothing is known about how much gears differ.
_FEWEST = 3


def read_fleet(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    encoding: str | None = None,
    sheet: str | None = None,
    specimen: str | None = None,
    scheduler: str | None = None,
    all_rows: bool = False,
    **how: Any,
) -> FleetReadings:
    """Return the readings of many gears; gears with a fault are named in its `faults`.

    The data are those of `hdcal.fleet`, all else but the Dask scheduler is as in
    `read_case`. Of Parquet files the case has the first rows only, unless all are asked
    for.

    Raises:
        InputError: holds what is wrong with the data as a whole.
    """
    if is_parquet(data) and not all_rows:
        found, sums = parquet_readings(open_parquet(data, gear, **how), scheduler)
        return _with_faults(found, sums.left_out, sums.observed)
    if scheduler is not None:
        words = "only Parquet files can be read on a Dask cluster"
        remedy = "Leave it out, or save the data as Parquet files"
        raise InputError([Finding("scheduler", words, remedy)])
    how |= {"encoding": encoding, "skip_bad": True}
    sizes = None
    if isinstance(data, Case):
        case = data
    elif gear_files(data):
        case, sizes = read_gear_folder(data, gear, **how)
    else:
        case = read_case(data, gear, sheet=sheet, specimen=specimen, **how)
    faults, observations = {}, ()
    if case is not data:
        # Which gears are left out is decided later.
        faults, case = case.left_out, replace(case, left_out={})
    if case.screening is not None:
        observations = case.screening.observations
        listed = screening_notes(replace(case.screening, trembling=False), case.units)
        notes = (note for note in case.notes if note not in listed)
        case = replace(case, notes=tuple(notes))
    found = replace(fleet_readings(case), sizes=sizes)
    return _with_faults(found, faults, [(case.name, each) for each in observations])


def _with_faults(
    readings: FleetReadings,
    left_out: Mapping[str, Finding],
    observed: Sequence[tuple[str, Observation]],
) -> FleetReadings:
    """Return readings with the faults of their gears, and notes on other findings.

    What more than half of the gears show is of the test, and no fault of a gear. Some
    gears could not be read; screening observed the others in their files.
    """
    case = readings.case
    showing: dict[str, set[str]] = defaultdict(set)
    for _, observation in observed:
        showing[observation.kind].add(observation.gear)
    half = len(case.specimen_labels) / 2.0
    faulty = {kind for kind in _FAULTS if len(showing[kind]) <= half}
    faults, notes = dict(left_out), []
    remedy = "Correct the record, or leave the gear out"
    for file, found in observed:
        if found.kind in faulty:
            kind = case.units.say(_FAULTS[found.kind])
            words = f"{kind}: {abs(found.size):.4g} {found.unit} at {found.where}"
            faults.setdefault(found.gear, Finding(file, words, remedy))
        else:
            notes.append(f"gear {quoted(found.gear)}: {found.words}")
    if more := len(notes[_LISTED:]):
        notes[_LISTED:] = [f"and {more} more findings in the records"]
    case = replace(case, notes=(*case.notes, *notes))
    return replace(readings, case=case, faults=faults)


def usable(
    readings: FleetReadings,
    gears: Any = None,
    *,
    skip_bad: bool = False,
    smooth: bool = True,
) -> FleetReadings:
    """Return the readings of gears without a fault, at the sizes of the gear file.

    A record that is not smooth is a fault unless `smooth` is False.

    Raises:
        InputError: a gear has a fault and may not be left out, fewer than three are
            left, none scatters about its line, or the table cannot be read.
    """
    bad = dict(readings.faults)
    many = len({*readings.case.specimen_labels, *bad})
    readings = replace(readings.without(bad), faults={})
    with Findings() as wrong:
        if gears is not None and readings.sizes is not None:
            words = "the gear file of each gear states its sizes"
            wrong.append(Finding("gears", words, "Leave it out"))
        elif gears is not None or readings.sizes is not None:
            table = readings.sizes if gears is None else gears
            ratio, unsized = gear_sizes(table, readings.case)
            bad |= unsized
            readings = readings.at_one_size(ratio).without(unsized)
        unlike = faults_among_gears(readings, smooth=smooth)
        bad |= unlike
        readings = readings.without(unlike)
        left = len(readings.case.specimen_labels)
        if bad and (left < _FEWEST or not skip_bad):
            wrong += _of_gears(bad)
        if left < _FEWEST:
            words = f"{left} of {many} gears can be used; the scatter between gears "
            words += f"needs at least {_FEWEST}"
            remedy = "Correct the others; `columns` specimen=HEADER names the gear"
            wrong.append(Finding(readings.case.name, words, remedy))
        elif bad and not skip_bad:
            wrong.append(offer(bad, many))
    require_scatter(readings.case)
    case, records = readings.case, readings.case.records
    # Of very many gears only the first rows are there, or none that are left.
    if len(records.force):
        # Shipped priors are shares of the largest readings that are left.
        force, read = np.asarray(records.force), np.asarray(records.deformation)
        gear = at_full_scale(case.gear, scale_of(force, read, case.gear.reading))
        case = replace(case, gear=gear)
    return replace(readings, case=case, sizes=None)


def _of_gears(bad: Mapping[str, Finding]) -> list[Finding]:
    """Return the faults of gears, each with its name."""
    faults = [
        replace(why, problem=f"gear {quoted(gear)}: {why.problem}")
        for gear, why in bad.items()
    ]
    if more := len(faults[LISTED:]):
        words = f"and {more} more gear{' has' if more == 1 else 's have'} a fault"
        faults[LISTED:] = [Finding(faults[0].file, words, "Correct these too")]
    return faults
