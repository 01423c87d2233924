"""Which gears an answer can rest on: the others are refused, or left out whole."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hdcal.data.findings import LISTED
from hdcal.data.full_scale import scale_of
from hdcal.data.gear import at_full_scale
from hdcal.data.measurements.bad_gears import among, offer
from hdcal.data.scatter import require_scatter
from hdcal.errors import Finding, Findings, quoted
from hdcal.fleets.gear_table import GearSizes, gear_sizes
from hdcal.fleets.readings import FleetReadings

# Fewer gears say next to nothing of how much gears differ.
FEWEST = 3
# Share of squares that rounding alone leaves of a deformation that stays.
_STILL = 1e-24


def usable(
    readings: FleetReadings, gears: Any = None, *, skip_bad: bool = False
) -> tuple[FleetReadings, np.ndarray]:
    """Return what the answer can rest on, and how much its sizes make a gear stiffer.

    Args:
        readings: of all gears.
        gears: table of their sizes, as in `gear_sizes`; None where they do not differ.
        skip_bad: leave out gears that say nothing of their stiffness or size.

    Raises:
        InputError: there are too few, none scatters about its line, the table cannot be
            read, or a gear is bad and may not be left out.

    Returns:
        The readings; and the ratio of each gear, shape (g,).
    """
    case = readings.case
    labels = case.specimen_labels
    with Findings() as wrong:
        bad = _still(readings)
        sizes = GearSizes(np.ones(len(labels)), {}, ())
        if gears is not None and readings.sizes is not None:
            words = "the sizes are in the gear file of each gear"
            wrong.append(Finding("gears", words, "Leave it out"))
        gears = readings.sizes if gears is None else gears
        if gears is not None:
            sizes = wrong.attempt(gear_sizes, gears, case) or sizes
        if not skip_bad:
            wrong += [_of_gear(gear, why) for gear, why in bad.items()]
            wrong += sizes.findings
        bad |= sizes.bad
        left_out = case.left_out | (bad if skip_bad else {})
        left = len(labels) - len(bad) * skip_bad
        wrong += _too_few(left, left_out, case.name)
        if bad and not skip_bad and len(bad) < len(labels):
            wrong.append(offer(bad, len(labels)))
    readings = _at_own_scale(readings.without(bad))
    require_scatter(readings.case)
    return readings, sizes.ratio[~among(labels, bad)]


def _at_own_scale(readings: FleetReadings) -> FleetReadings:
    """Return readings whose shipped priors are shares of the largest that are left."""
    case, records = readings.case, readings.case.records
    # Of many gears the first rows alone are at hand, or none of those that are left.
    if not len(records.force):
        return readings
    force, read = np.asarray(records.force), np.asarray(records.deformation)
    gear = at_full_scale(case.gear, scale_of(force, read, case.gear.reading))
    return replace(readings, case=replace(case, gear=gear))


def _still(readings: FleetReadings) -> dict[str, Finding]:
    """Return gears that never moved in a run, which has a zero of its own."""
    case, sums = readings.case, readings.sums
    moved = np.bincount(sums.gear, sums.xx)
    still = moved <= _STILL * np.bincount(sums.gear, sums.rows * sums.x**2)
    words = f"was read at one {case.units.displacement} only in each of its runs"
    remedy = "Read it at two or more in one run, or leave it out"
    one = Finding(case.name, words, remedy)
    return {case.specimen_labels[gear]: one for gear in np.flatnonzero(still)}


def _of_gear(gear: str, finding: Finding) -> Finding:
    colon = "" if finding.row is None else ":"
    return replace(finding, problem=f"gear {quoted(gear)}{colon} {finding.problem}")


def _too_few(left: int, left_out: Mapping[str, Finding], name: str) -> list[Finding]:
    """Return that too few gears are left, and what is wrong with the others."""
    if left >= FEWEST:
        return []
    many = "1 gear" if left == 1 else f"{left} gears"
    words = f"{many}: how much gears differ takes {FEWEST} or more"
    remedy = "Say `columns` specimen=HEADER, which names the gear of a row"
    if left_out:
        words = f"of {left + len(left_out)} gears {left} can be used. {words}"
        remedy = "Mend what is wrong with the others"
    each = [_of_gear(gear, why) for gear, why in left_out.items()]
    return [*each[:LISTED], Finding(name, words, remedy)]
