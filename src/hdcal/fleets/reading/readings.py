"""Readings of many gears, as sums over each mounting."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import jax
import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.loading import loading_side
from hdcal.data.measurements.bad_gears import among
from hdcal.errors import Finding
from hdcal.fleets.reading.mounting_sums import MountingSums, RowSums, reading_vectors
from hdcal.inference import distributions
from hdcal.screening.local_fit import least_step


@dataclass(frozen=True)
class FleetReadings:
    """Readings of a fleet.

    Attributes:
        case: gears, runs and notes; its records are all readings, or the first ones
            where there are very many.
        sums: of each mounting; the mean has the opposite sign where gears were pulled.
        side: −1 where they were pulled, else 1.
        size_ratio: stiffness of the sizes of each gear over that of the sizes in the
            gear file, by which x was multiplied, shape (g,); None without such sizes.
        sizes: sizes of each gear by column, if it has its own gear file.
        faults: gears with a fault, each with what it is; some are among the readings.
    """

    case: Case
    sums: MountingSums
    side: int = 1
    size_ratio: np.ndarray | None = None
    sizes: Mapping[str, Sequence] | None = None
    faults: Mapping[str, Finding] = field(default_factory=dict)

    @property
    def largest(self) -> float:
        """Largest deformation as read, with its sign [mm]."""
        ratio = 1.0 if self.size_ratio is None else self.size_ratio[self.sums.gear]
        reach = self.sums.reach / ratio
        farthest = int(np.argmax(reach))
        sign = self.side * np.sign(self.sums.mean[farthest, 0])
        return float(np.copysign(reach[farthest], sign))

    @property
    def step(self) -> float:
        """Step of the force display, or else the least one between readings [N]."""
        stated = self.case.gear.force_resolution
        return stated or least_step(np.asarray(self.case.records.force))

    def at_one_size(self, ratio: np.ndarray) -> "FleetReadings":
        """Return sums in which every gear has the sizes of the gear file.

        The ratio is that of the stiffness of its sizes to that of these, shape (g,).
        """
        sums = self.sums.stretched(ratio[self.sums.gear])
        return replace(self, sums=sums, size_ratio=ratio)

    def without(self, bad: Mapping[str, Finding]) -> "FleetReadings":
        """Return the readings of other gears than the bad ones, which are left out."""
        case, sums = self.case, self.sums
        left_out = {**case.left_out, **bad}
        gone = among(case.specimen_labels, bad)
        if not gone.any():
            return replace(self, case=replace(case, left_out=left_out))
        sums = sums.where(~gone[sums.gear])
        gears, gear = np.unique(sums.gear, return_inverse=True)
        runs, run = np.unique(sums.run, return_inverse=True)
        rows = np.isin(case.records.run, runs) & np.isin(case.records.specimen, gears)
        records = jax.tree.map(lambda column: np.asarray(column)[rows], case.records)
        records = replace(
            records,
            specimen=np.searchsorted(gears, records.specimen),
            run=np.searchsorted(runs, records.run),
        )
        of_gears = {n: _some(getattr(case, n), gears) for n in _OF_GEARS}
        of_runs = {n: _some(getattr(case, n), runs) for n in _OF_RUNS}
        case = replace(case, records=records, left_out=left_out, **of_gears, **of_runs)
        ratio = None if self.size_ratio is None else self.size_ratio[gears]
        sums = replace(sums, gear=gear, run=run)
        return replace(self, case=case, sums=sums, size_ratio=ratio)


_OF_GEARS = "specimen_labels", "lots"
_OF_RUNS = "run_labels", "operators", "rigs", "dates"


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
    return readings_of(case, gear, run, RowSums.of(index.ravel(), v, read))


def readings_of(
    case: Case, gear: np.ndarray, run: np.ndarray, sums: RowSums
) -> FleetReadings:
    """Return the readings of a case from the sums of its mountings.

    The indices of gear and run are those of each mounting; gears ascend, shape (m,).
    """
    side = loading_side(np.array([sums.low.min(), sums.high.max()])) or 1
    # All components of v are odd in the deformation.
    each = {**vars(sums), "mean": side * sums.mean}
    return FleetReadings(case, MountingSums(**each, gear=gear, run=run), side)


def modulus_left(gear: Gear, temperature):
    """Return the modulus at temperatures [°C] over that at the reference."""
    loss, _ = distributions.moments(gear.priors["alpha"])
    return 1.0 - loss * (temperature - gear.reference_temperature)
