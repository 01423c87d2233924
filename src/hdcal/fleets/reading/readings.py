"""Readings of many gears, as sums over each mounting."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import jax
import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.loading import loading_side
from hdcal.data.measurements.bad_gears import among
from hdcal.data.scatter import reading_step
from hdcal.errors import Finding, InputError, quoted
from hdcal.fleets.reading.mounting_sums import MountingSums, RowSums, reading_vectors
from hdcal.inference import distributions


@dataclass(frozen=True)
class FleetReadings:
    """Readings of a fleet.

    Attributes:
        case: gears, runs and notes; its records are all readings, or the first ones
            where there are very many.
        sums: of each mounting. Gears that were pulled are mirrored: their deformation,
            sense and force have the opposite sign.
        side: −1 where they were pulled and mirrored, else 1.
        size_ratio: stiffness of the sizes of each gear over that of the sizes in the
            gear file, by which x was multiplied, shape (g,); None where all gears have
            the sizes of the gear file.
        sizes: sizes of each gear by column, if it has its own gear file.
        faults: gears with a fault, each with what it is; some are among the readings.
        checked: whether no gear with a fault is left.
    """

    case: Case
    sums: MountingSums
    side: int = 1
    size_ratio: np.ndarray | None = None
    sizes: Mapping[str, Sequence] | None = None
    faults: Mapping[str, Finding] = field(default_factory=dict)
    checked: bool = False

    @property
    def largest(self) -> float:
        """Largest deformation as read, with its sign [mm]."""
        farthest = int(np.argmax(self.sums.reach))
        sign = self.side * np.sign(self.sums.mean[farthest, 0])
        return float(np.copysign(self.sums.reach[farthest], sign))

    @property
    def step(self) -> float:
        """Step of the force display [N]."""
        return reading_step(self.case)

    def at_one_size(self, ratio: np.ndarray) -> "FleetReadings":
        """Return sums in which every gear has the sizes of the gear file.

        Args:
            ratio: stiffness of the sizes of each gear over that of these, by which its
                deformations are multiplied, shape (g,).
        """
        sums = self.sums.stretched(ratio[self.sums.gear])
        return replace(self, sums=sums, size_ratio=ratio)

    def since(self, day: str) -> "FleetReadings":
        """Return what was read on a day or later, of mountings with a date.

        Args:
            day: as 2026-09-01.

        Raises:
            InputError: it is no day, the data have no dates, or nothing was read then.
        """
        kept = _read_since(self.case, day)[self.sums.run]
        if not kept.any():
            words = f"nothing was read on {quoted(day)} or later"
            words = words if self.case.dates else "the data have no dates"
            raise InputError([Finding("since", words, "See the dates of the data")])
        found = self._where(kept)
        notes = (*self.case.notes, f"What was read before {day} is left out.")
        return replace(found, case=replace(found.case, notes=notes))

    def without(self, bad: Mapping[str, Finding]) -> "FleetReadings":
        """Return the readings of other gears.

        Args:
            bad: gears that are left out, each with its fault.
        """
        gone = among(self.case.specimen_labels, bad)
        found = self._where(~gone[self.sums.gear]) if gone.any() else self
        left_out = {**self.case.left_out, **bad}
        return replace(found, case=replace(found.case, left_out=left_out))

    def _where(self, kept: np.ndarray) -> "FleetReadings":
        """Return the readings of some mountings, a mask of shape (m,)."""
        case, sums = self.case, self.sums.where(kept)
        gears, gear = np.unique(sums.gear, return_inverse=True)
        runs, run = np.unique(sums.run, return_inverse=True)
        records = case.records
        rows = np.isin(records.run, runs) & np.isin(records.specimen, gears)
        records = jax.tree.map(lambda column: np.asarray(column)[rows], records)
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
        ratio = None if self.size_ratio is None else self.size_ratio[gears]
        sums = replace(sums, gear=gear, run=run)
        return replace(self, case=case, sums=sums, size_ratio=ratio)


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
    """Return the readings of a case."""
    records = case.records
    labels = np.stack([np.asarray(records.specimen), np.asarray(records.run)])
    (gear, run), index = np.unique(labels, axis=1, return_inverse=True)
    read, force = np.asarray(records.deformation), np.asarray(records.force)
    x = read * modulus_left(case.gear, np.asarray(records.temperature))
    v = reading_vectors(x, np.asarray(records.sense), force)
    sums = RowSums.of(index.ravel(), v, read)
    return readings_of(case, gear, run, sums)


def readings_of(
    case: Case, gear: np.ndarray, run: np.ndarray, sums: RowSums
) -> FleetReadings:
    """Return the readings of a case from the sums of its mountings.

    Args:
        case: gears and runs.
        gear: index of the gear of each mounting, ascending, shape (m,).
        run: index of its run, shape (m,).
        sums: of its rows.
    """
    side = loading_side(np.array([sums.low.min(), sums.high.max()])) or 1
    reach = np.maximum(np.abs(sums.low), np.abs(sums.high))
    # All components of v are odd in the deformation.
    mean, products, lagged = side * sums.mean, sums.products, sums.lagged
    each = MountingSums(gear, run, sums.rows, mean, products, lagged, reach)
    return FleetReadings(case, each, side)


def modulus_left(gear: Gear, temperature):
    """Return the modulus at temperatures [°C] over that at the reference."""
    loss, _ = distributions.moments(gear.priors["alpha"])
    return 1.0 - loss * (temperature - gear.reference_temperature)
