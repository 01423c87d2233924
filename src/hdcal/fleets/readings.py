"""From readings to what each mounting says: seven sums, whatever the number of rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.measurements.bad_gears import among
from hdcal.errors import Finding, InputError, quoted
from hdcal.evidence.row_features import take_rows
from hdcal.fleets.gear_sums import MountingSums, stretched
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.groups import group_of, read_by
from hdcal.inference import distributions


@dataclass(frozen=True)
class FleetReadings:
    """What was measured on a fleet.

    Attributes:
        case: its gears, runs and notes; the records are all readings, or those of the
            first gears where there are very many.
        sums: of each gear in each mounting.
        runs: index of each mounting's run, shape (m,).
        reach: largest deformation of each mounting, its size, shape (m,) [mm as read].
        sizes: of each gear, by column, where a gear file of its own states them.
    """

    case: Case
    sums: MountingSums
    runs: np.ndarray
    reach: np.ndarray
    sizes: Mapping[str, Sequence] | None = None

    @property
    def largest(self) -> float:
        """Largest deformation, with the sign of its mounting's mean [mm as read]."""
        farthest = int(np.argmax(self.reach))
        return float(np.copysign(self.reach[farthest], self.sums.x[farthest]))

    def at_one_size(self, ratio: np.ndarray) -> "FleetReadings":
        """Return the sums as if all gears had the gear file's sizes.

        Args:
            ratio: stiffness of each gear's sizes over that of these, by which its
                deformations count; shape (g,).
        """
        return replace(self, sums=stretched(self.sums, ratio[self.sums.gear]))

    def on_one_rig(self, draws: Mapping[str, np.ndarray]) -> "FleetReadings":
        """Return sums and records as if a rig of the mean gain had read them all.

        Args:
            draws: of the population by site, shape (t,).
        """
        gain = 1.0 + np.median(np.asarray(group_offsets(draws, "rig")), axis=1)
        case, sums = self.case, stretched(self.sums, gain[self.sums.rig])
        records = case.records
        rig = group_of(case.rigs, np.asarray(records.run))
        records = replace(records, deformation=gain[rig] * records.deformation)
        return replace(self, case=replace(case, records=records), sums=sums)

    def since(self, day: str) -> "FleetReadings":
        """Return what was read on a day or later; mountings without a date are not.

        Args:
            day: as 2026-09-01.

        Raises:
            InputError: it is no day, no dates are told, or nothing was read then.
        """
        of_mounting = _read_since(self.case, day)[self.runs]
        if not of_mounting.any():
            words = f"nothing was read on {quoted(day)} or later"
            words = words if self.case.dates else "no dates are told"
            raise InputError([Finding("since", words, "See the dates of the data")])
        found = self._of(of_mounting)
        notes = (*self.case.notes, f"What was read before {day} is left out.")
        return replace(found, case=replace(found.case, notes=notes))

    def without(self, bad: Mapping[str, Finding]) -> "FleetReadings":
        """Return what was read on other gears.

        Args:
            bad: gears that are left out, each with what is wrong with it.
        """
        gone = among(self.case.specimen_labels, bad)
        found = self._of(~gone[self.sums.gear]) if gone.any() else self
        left_out = self.case.left_out | dict(bad)
        return replace(found, case=replace(found.case, left_out=left_out))

    def _of(self, of_mounting: np.ndarray) -> "FleetReadings":
        """Return what was read in some of the mountings, a mask of shape (m,)."""
        case, sums = self.case, self.sums
        gears, gear = np.unique(sums.gear[of_mounting], return_inverse=True)
        runs, run = np.unique(self.runs[of_mounting], return_inverse=True)
        columns = {name: value[of_mounting] for name, value in vars(sums).items()}
        records = case.records
        rows = np.isin(records.run, runs) & np.isin(records.specimen, gears)
        records = take_rows(records, np.flatnonzero(rows))
        records = replace(
            records,
            specimen=np.searchsorted(gears, records.specimen),
            run=np.searchsorted(runs, records.run),
        )
        case = replace(
            case,
            records=records,
            specimen_labels=_some(case.specimen_labels, gears),
            run_labels=_some(case.run_labels, runs),
            lots=_some(case.lots, gears),
            operators=_some(case.operators, runs),
            rigs=_some(case.rigs, runs),
            dates=_some(case.dates, runs),
        )
        # Groups are told apart anew: some may be gone.
        sums = MountingSums(**columns | {"gear": gear} | read_by(case, run))
        reach = self.reach[of_mounting]
        return replace(self, case=case, sums=sums, runs=run, reach=reach)


def _read_since(case: Case, day: str) -> np.ndarray:
    """Return which runs were read on a day or later, shape (r,)."""
    try:
        first = np.datetime64(day, "D")
    except (ValueError, TypeError):
        words, remedy = f"{quoted(day)} is no day", "Write it as 2026-09-01"
        raise InputError([Finding("since", words, remedy)]) from None
    if not case.dates:
        return np.zeros(len(case.run_labels), bool)
    dates = np.array([date or "NaT" for date in case.dates], "datetime64[s]")
    return dates >= first


def _some(labels: tuple[str, ...], places: np.ndarray) -> tuple[str, ...]:
    return tuple(labels[place] for place in places) if labels else ()


def fleet_readings(case: Case) -> FleetReadings:
    """Return what the readings of a case come to."""
    records, gear = case.records, case.gear
    labels = np.stack([np.asarray(records.specimen), np.asarray(records.run)])
    (of_gear, runs), of_row = np.unique(labels, axis=1, return_inverse=True)
    read, y = np.asarray(records.deformation), np.asarray(records.force)
    x = read * modulus_left(gear, np.asarray(records.temperature))
    each = row_sums(of_row.ravel(), x, y)
    sums = MountingSums(of_gear, *each, **read_by(case, runs))
    return FleetReadings(case, sums, runs, largest_of(of_row.ravel(), np.abs(read)))


def largest_of(of_row: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the largest of the values of each mounting, none of which is negative.

    Args:
        of_row: index of its mounting, shape (n,).
        values: shape (n,).
    """
    found = np.zeros(1 + int(of_row.max()))
    np.maximum.at(found, of_row, values)
    return found


def modulus_left(gear: Gear, temperature):
    """Return the modulus at temperatures [°C] over that at the reference."""
    loss, _ = distributions.moments(gear.priors["alpha"])
    return 1.0 - loss * (temperature - gear.reference_temperature)


def row_sums(
    of_row: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return number, means and sums about them of the readings of each mounting.

    Args:
        of_row: index of its mounting, shape (n,).
        x: deformation, shape (n,).
        y: force, shape (n,).
    """
    rows = np.bincount(of_row).astype(float)
    mean_x, mean_y = (np.bincount(of_row, v) / rows for v in (x, y))
    about_x, about_y = x - mean_x[of_row], y - mean_y[of_row]
    products = (about_x**2, about_x * about_y, about_y**2)
    xx, xy, yy = (np.bincount(of_row, each) for each in products)
    return rows, mean_x, mean_y, xx, xy, yy
