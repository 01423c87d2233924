"""Rows that come in batches: of each mounting sums are kept, whatever their number."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdcal.data.bad_gears import among
from hdcal.data.case import Gear
from hdcal.data.further_labels import further_labels
from hdcal.data.measurements import Labels
from hdcal.data.mountings import TELLING, run_labels
from hdcal.data.parquet import Batch, Parquet, read_batches
from hdcal.data.reading_notes import mountings_note
from hdcal.data.tables.headers import GROUPINGS
from hdcal.data.tables.named_columns import Column
from hdcal.errors import Finding
from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.groups import read_by
from hdcal.fleets.readings import (
    FleetReadings,
    largest_of,
    modulus_left,
    row_sums,
)

# Stands in no label.
_BETWEEN = "\n"
_LOST = "start again: reading takes a small part of the time"


@dataclass
class Pool:
    """Sums of what was read so far; two of them can be joined.

    Attributes:
        gear: what is known of all gears.
        gears: index of each gear, in order of appearance.
        runs: index of each gear and run, likewise.
        parts: run, reach, rows, means and sums of each mounting in each batch.
        told: of each batch, runs, and their lots, operators, rigs and dates.
        left_out: gears of which something is wrong, each with what that is. Rows of
            those that were known before are not read.
    """

    gear: Gear
    gears: dict[str, int] = field(default_factory=dict)
    runs: dict[tuple[int, str], int] = field(default_factory=dict)
    parts: list[tuple[np.ndarray, ...]] = field(default_factory=list)
    told: list[dict[str, np.ndarray]] = field(default_factory=list)
    left_out: dict[str, Finding] = field(default_factory=dict)

    def add(self, batch: Batch) -> None:
        """Add some rows."""
        gear_of, gears = batch.labels["specimen"]
        batch = batch.where(~among(gears, self.left_out)[gear_of])
        self.left_out |= batch.bad
        if not len(batch.values["deformation"]):
            return
        gear, read = self.gear, batch.values["deformation"]
        warm = batch.values.get("temperature", gear.reference_temperature)
        x = read * modulus_left(gear, warm)
        gear_of, gears = batch.labels["specimen"]
        run_of, runs = batch.labels.get("run") or _told(batch)
        first, pair = _in_order(gear_of * len(runs) + run_of)
        each = zip(gears[gear_of[first]], runs[run_of[first]], strict=True)
        index = np.array([self._run(str(one), str(run)) for one, run in each])
        reach = largest_of(pair, np.abs(read))
        self.parts.append((index, reach, *row_sums(pair, x, batch.values["force"])))
        further = {name: one for name, one in batch.labels.items() if name in GROUPINGS}
        first = _apart(pair, further.values())[0]
        told = {name: texts[place[first]] for name, (place, texts) in further.items()}
        self.told.append({"run": index[pair[first]], **told})

    def join(self, other: "Pool", labels: Iterable[str] | None = None) -> None:
        """Add what another one has, whose rows come after those of this one.

        Args:
            other: the other one.
            labels: of each of its runs; by default its own.
        """
        gears, of = [*other.gears], [gear for gear, _ in other.runs]
        labels = [run for _, run in other.runs] if labels is None else labels
        each = zip(of, labels, strict=True)
        index = np.array([self._run(gears[g], run) for g, run in each], int)
        self.parts += [(index[run], *sums) for run, *sums in other.parts]
        self.told += [told | {"run": index[told["run"]]} for told in other.told]
        self.left_out = other.left_out | self.left_out

    def _run(self, gear: str, run: str) -> int:
        known = self.gears.setdefault(gear, len(self.gears))
        return self.runs.setdefault((known, run), len(self.runs))

    def mounted(self, told: Sequence[str]) -> "Pool":
        """Return the same, its runs told by their dates, rigs and operators.

        Args:
            told: those of these that the runs are labelled by, so far.
        """
        of = np.array([gear for gear, _ in self.runs])
        cells = np.array([run.split(_BETWEEN) for _, run in self.runs], object)
        columns = cells.reshape(-1, len(told)).T
        labels = run_labels(dict(zip(told, columns, strict=True)), of)
        whole = Pool(self.gear)
        whole.join(self, [""] * len(of) if labels is None else labels)
        return whole

    def readings(self, source: Parquet) -> FleetReadings:
        """Return what all of them come to, without the gears that are left out.

        Args:
            source: where they are from.
        """
        parts = map(np.concatenate, zip(*self.parts, strict=True))
        run, reach, rows, x, y, xx, xy, yy = parts

        def whole(part: np.ndarray) -> np.ndarray:
            return np.bincount(run, part)

        total = whole(rows)
        mean_x, mean_y = whole(rows * x) / total, whole(rows * y) / total
        off_x, off_y = x - mean_x[run], y - mean_y[run]
        squares = [
            whole(own + rows * between)
            for own, between in ((xx, off_x**2), (xy, off_x * off_y), (yy, off_y**2))
        ]
        gears, gear = tuple(self.gears), np.array([g for g, _ in self.runs])
        names = tuple(f"{gears[g]}/{r}" if r else gears[g] for g, r in self.runs)
        case = replace(
            source.case,
            name=source.name,
            specimen_labels=gears,
            run_labels=names,
            data_sha256=source.sha256,
        )
        nobody = np.zeros(len(gear), int)
        sums = MountingSums(
            gear, total, mean_x, mean_y, *squares, operator=nobody, rig=nobody
        )
        runs, farthest = np.arange(len(gear)), largest_of(run, reach)
        readings = FleetReadings(case, sums, runs, farthest)
        left = ~among(gears, self.left_out)[gear]
        found = self._labelled(readings.without(self.left_out), gear, left)
        case = found.case
        many = len(case.run_labels), len(case.specimen_labels)
        if "run" in source.used or many[0] == many[1]:
            return found
        notes = (*case.notes, mountings_note(source.used, *many))
        return replace(found, case=replace(case, notes=notes))

    def _labelled(
        self, readings: FleetReadings, gear: np.ndarray, left: np.ndarray
    ) -> FleetReadings:
        """Return readings with what further labels say of the gears that are left.

        Args:
            readings: of these.
            gear: of each run of all gears, shape (r,).
            left: which runs are of gears that are left, shape (r,).
        """
        told = {
            name: np.concatenate([one[name] for one in self.told])
            for name in self.told[0]
        }
        of = told.pop("run")
        rows, case = left[of], readings.case
        run = np.searchsorted(np.flatnonzero(left), of[rows])
        own = np.searchsorted(np.unique(gear[left]), gear[of[rows]])
        further, notes = further_labels(
            {name: labels[rows] for name, labels in told.items()},
            Labels(own, case.specimen_labels),
            Labels(run, case.run_labels),
        )
        case = replace(case, notes=(*case.notes, *notes), **further)
        sums = replace(readings.sums, **read_by(case, readings.runs))
        return replace(readings, case=case, sums=sums)


def pool_of(
    source: Parquet, scheduler: str | None = None, *, skip_bad: bool | None = None
) -> Pool:
    """Return what all files come to, whoever reads them.

    Args:
        source: the files.
        scheduler: address of a Dask scheduler, whose workers read them instead; they
            have to find them under the same names.
        skip_bad: as in `read_case`.

    Raises:
        InputError: holds what is wrong with the first batch that is; or nobody answers
            or works there.
        HdcalError: the cluster was lost.
    """
    known = source.case.left_out
    about = source.root, source.used, source.case.gear, known, skip_bad
    tasks = ((place, file, *about) for place, file in enumerate(source.files))
    if scheduler is None:
        found = (file_pool(*task) for task in tasks)
    else:
        from hdcal.cli.cluster import completed_on_cluster

        found = completed_on_cluster(file_pool, tasks, scheduler, _LOST)
    whole, early, joined = Pool(source.case.gear, left_out={**known}), {}, 0
    for place, pool in found:
        early[place] = pool
        # In the order of the files, so that the answer hangs on no worker.
        while joined in early:
            whole.join(early.pop(joined))
            joined += 1
    told = [name for name in TELLING if name in source.used]
    return whole.mounted(told) if told and "run" not in source.used else whole


def file_pool(
    place: int,
    file: str,
    root: str,
    used: Mapping[str, Column],
    gear: Gear,
    left_out: Mapping[str, Finding],
    skip_bad: bool | None = None,
) -> tuple[int, Pool]:
    """Return what one file comes to, and its place among all.

    Raises:
        InputError: holds what is wrong with its first batch that is.
    """
    pool = Pool(gear, left_out={**left_out})
    for batch in read_batches(file, root, used, gear, skip_bad=skip_bad):
        pool.add(batch)
    return place, pool


def _told(batch: Batch) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of each row's date, rig and operator, and these as one label."""
    told = [batch.labels[name] for name in TELLING if name in batch.labels]
    first, index = _apart(np.zeros(len(batch.values["deformation"]), int), told)
    cells = zip(*(texts[place[first]] for place, texts in told), strict=True)
    return index, np.array([_BETWEEN.join(each) for each in cells] or [""], object)


def _apart(
    code: np.ndarray, labels: Iterable[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Return as `_in_order`, of values that also differ where one of labels does."""
    for place, texts in labels:
        code = _in_order(code * len(texts) + place)[1]
    return _in_order(code)


def _in_order(code: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where each value stands first, in that order, and each row's value's."""
    _, first, index = np.unique(code, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[index]
