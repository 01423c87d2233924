"""Readings of many gears, as sums over each mounting."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Self

import jax
import numpy as np

from hdcal.data.case import Case, Gear, from_contact
from hdcal.data.loading import loading_side
from hdcal.data.measurements.bad_gears import among
from hdcal.errors import Finding
from hdcal.inference import distributions
from hdcal.screening.local_fit import least_step


@dataclass(frozen=True)
class RowSums:
    """Sums over p sets of rows, of the vector v = (x, sense, x|x|, y) of every row.

    x is the deformation as read times the modulus that is left [mm], the sense that of
    the movement (1 loading, −1 unloading), y the force [N].

    Attributes:
        rows: number of rows, shape (p,).
        mean: of v, shape (p, 4).
        products: sum of (v − mean)(v − mean)ᵀ, shape (p, 4, 4).
        lagged: sum of (v_t − mean)(v_{t−1} − mean)ᵀ over successive rows.
        first: v of the first row, as `last` is of the last one, shape (p, 4).
        low: smallest deformation, as `high` is the largest, shape (p,) [mm].
    """

    rows: np.ndarray
    mean: np.ndarray
    products: np.ndarray
    lagged: np.ndarray
    first: np.ndarray
    last: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, v: np.ndarray, deformation: np.ndarray) -> "RowSums":
        """Sum rows v, (4, n), of deformations as read, in the order they were taken.

        The index is that of the set of each row, 0, 1, … without a gap.
        """
        order = np.argsort(index, kind="stable")
        rows = np.bincount(index)
        start = np.cumsum(rows) - rows
        v, read = v[:, order], deformation[order]
        mean = np.add.reduceat(v, start, axis=1) / rows
        about = v - np.repeat(mean, rows, axis=1)
        before = np.zeros_like(about)
        before[:, 1:] = about[:, :-1]
        before[:, start] = 0.0
        products, lagged = np.empty((2, len(rows), len(v), len(v)))
        for i, row in enumerate(about):
            products[:, i] = np.add.reduceat(row * about, start, axis=1).T
            lagged[:, i] = np.add.reduceat(row * before, start, axis=1).T
        return RowSums(
            rows.astype(float),
            mean.T,
            products,
            lagged,
            v[:, start].T,
            v[:, start + rows - 1].T,
            np.minimum.reduceat(read, start),
            np.maximum.reduceat(read, start),
        )

    @property
    def reach(self) -> np.ndarray:
        """Largest deformation without its sign, shape (p,) [mm]."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    def where(self, kept: np.ndarray) -> Self:
        """Return some sets, by a mask or by indices."""
        return type(self)(*(getattr(self, each.name)[kept] for each in fields(self)))

    def joined(self, index: np.ndarray) -> "RowSums":
        """Return the sums of wholes whose parts these are, in the order of the rows.

        The index is that of the whole of each part, 0, 1, … without a gap.
        """
        order = np.argsort(index, kind="stable")
        parts, whole = self.where(order), index[order]
        start = np.searchsorted(whole, np.arange(1 + whole.max()))
        end = np.append(start[1:], len(whole)) - 1
        rows, each = np.add.reduceat(parts.rows, start), parts.rows[:, None]
        mean = np.add.reduceat(each * parts.mean, start) / rows[:, None]
        middle = mean[whole]
        shift, first, last = (
            place - middle for place in (parts.mean, parts.first, parts.last)
        )
        between = each[..., None] * _outer(shift, shift)
        # Without the first row of a part its rows have another mean; likewise the last.
        lagged = parts.lagged + between + _outer(shift - first, shift)
        lagged -= _outer(shift, last)
        # The first row of a part follows the last one of the part before.
        later = np.setdiff1d(np.arange(len(whole)), start)
        lagged[later] += _outer(first[later], last[later - 1])
        return RowSums(
            rows,
            mean,
            np.add.reduceat(parts.products + between, start),
            np.add.reduceat(lagged, start),
            parts.first[start],
            parts.last[end],
            np.minimum.reduceat(parts.low, start),
            np.maximum.reduceat(parts.high, start),
        )

    def stretched(self, factor: np.ndarray) -> Self:
        """Return sums as if x were longer by a factor of each set, shape (p,)."""
        one = np.ones(len(factor))
        scale = np.stack([factor, one, factor * np.abs(factor), one], axis=1)
        return replace(
            self,
            mean=scale * self.mean,
            products=_outer(scale, scale) * self.products,
            lagged=_outer(scale, scale) * self.lagged,
            first=scale * self.first,
            last=scale * self.last,
            low=factor * self.low,
            high=factor * self.high,
        )


@dataclass(frozen=True)
class MountingSums(RowSums):
    """Sums of every mounting, with the index of its gear, ascending, and of its run."""

    gear: np.ndarray
    run: np.ndarray


def _outer(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, :, None] * other[:, None, :]


def reading_vectors(x: np.ndarray, sense: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return v of each row, shape (4, n)."""
    return np.stack([x, sense, x * np.abs(x), force])


@dataclass(frozen=True)
class FleetReadings:
    """Readings of a fleet.

    Attributes:
        case: gears, runs and notes; its records are all readings, or the first ones
            where there are very many.
        sums: of each mounting; the mean has the opposite sign where gears were pulled.
        side: −1 where they were pulled, else 1.
        size_ratio: stiffness of the sizes of each gear over that of the sizes in the
            gear file, by which x was multiplied, shape (g,).
        sizes: of each gear by column, if it has its own gear file.
        contact: deformation as read of the unloaded gears, from which all else here is
            counted [mm].
        faults: by gear; some of these are among the readings.
    """

    case: Case
    sums: MountingSums
    side: int = 1
    size_ratio: np.ndarray | None = None
    sizes: Mapping[str, Sequence] | None = None
    faults: Mapping[str, Finding] = field(default_factory=dict)
    contact: float = 0.0

    @property
    def largest(self) -> float:
        """Largest deformation, with its sign [mm]."""
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
        """Return sums in which every gear has the sizes of the gear file."""
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
        labels = {
            name: tuple(getattr(case, name)[place] for place in places)
            for names, places in ((_OF_GEARS, gears), (_OF_RUNS, runs))
            for name in names
            if getattr(case, name)
        }
        case = replace(case, records=records, left_out=left_out, **labels)
        ratio = None if self.size_ratio is None else self.size_ratio[gears]
        sums = replace(sums, gear=gear, run=run)
        return replace(self, case=case, sums=sums, size_ratio=ratio)


_OF_GEARS = "specimen_labels", "lots"
_OF_RUNS = "run_labels", "operators", "rigs", "dates"


def fleet_readings(case: Case) -> FleetReadings:
    """Return the readings of a case."""
    contact, case = case.gear.contact, from_contact(case)
    records = case.records
    labels = np.stack([np.asarray(records.specimen), np.asarray(records.run)])
    (gear, run), index = np.unique(labels, axis=1, return_inverse=True)
    read, force = np.asarray(records.deformation), np.asarray(records.force)
    x = read * relative_modulus(case.gear, np.asarray(records.temperature))
    v = reading_vectors(x, np.asarray(records.sense), force)
    found = readings_of(case, gear, run, RowSums.of(index.ravel(), v, read))
    return replace(found, contact=contact)


def readings_of(
    case: Case, gear: np.ndarray, run: np.ndarray, sums: RowSums
) -> FleetReadings:
    """Return readings; gears, which ascend, and runs are those of mountings, (m,)."""
    side = loading_side(np.array([sums.low.min(), sums.high.max()])) or 1
    # All components of v are odd in the deformation.
    each = {name: side * getattr(sums, name) for name in ("mean", "first", "last")}
    found = MountingSums(**{**vars(sums), **each}, gear=gear, run=run)
    return FleetReadings(case, found, side)


def relative_modulus(gear: Gear, temperature):
    """Return the modulus at temperatures [°C] over that at the reference."""
    loss, _ = distributions.moments(gear.priors["alpha"])
    return 1.0 - loss * (temperature - gear.reference_temperature)
