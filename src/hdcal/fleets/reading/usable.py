"""Gears on which the answer can rest: the others are refused, or left out whole."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hdcal.data.findings import LISTED
from hdcal.data.full_scale import scale_of
from hdcal.data.gear import at_full_scale
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.scatter import require_scatter
from hdcal.errors import Finding, Findings, quoted
from hdcal.fleets.reading.gear_sizes import gear_sizes
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.fleets.reading.record_faults import faults_among_gears

# From fewer gears next to nothing is known about how much gears differ.
FEWEST = 3


def usable(
    readings: FleetReadings, gears: Any = None, *, skip_bad: bool = False
) -> FleetReadings:
    """Return the readings of gears without a fault, at the sizes of the gear file.

    Args:
        readings: of all gears.
        gears: table of the sizes of each gear, if they differ.
        skip_bad: leave out gears with a fault.

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
        unlike = faults_among_gears(readings)
        bad |= unlike
        readings = readings.without(unlike)
        left = len(readings.case.specimen_labels)
        if bad and (left < FEWEST or not skip_bad):
            wrong += _of_gears(bad)
        if left < FEWEST:
            words = f"{left} gear{'' if left == 1 else 's'}: how much gears differ "
            words += f"takes {FEWEST} or more"
            remedy = "Say `columns` specimen=HEADER, which names the gear of a row"
            if bad:
                words = f"of {left + len(bad)} gears {left} can be used. {words}"
                remedy = "Correct what is wrong with the others"
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
    each = [
        replace(why, problem=f"gear {quoted(gear)}: {why.problem}")
        for gear, why in bad.items()
    ]
    if more := len(each[LISTED:]):
        words = f"and {more} more gear{' has' if more == 1 else 's have'} a fault"
        each[LISTED:] = [Finding(each[0].file, words, "Correct these too")]
    return each
